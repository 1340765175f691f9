"""Writes extremes.csv: what tests/extremes.rs compares with, worked out in 60 digits by mpmath (PyPI), from the equations of
docs/model.md alone. Doubles are given with all their digits, so that both sides start from the same numbers.

    python tests/reference/extremes.py > tests/reference/extremes.csv
"""

from mpmath import cbrt, erfc, erfinv, exp, floor, log, loggamma, mp, mpf, pi, sqrt

mp.dps = 60


def row(kind, inputs, values):
    print(",".join([kind, " ".join(repr(float(x)) for x in inputs), " ".join(mp.nstr(mpf(v), 25) for v in values)]))


def probability(count, rate):
    return exp(count * log(rate) - rate - loggamma(count + 1))


def below(count, rate):
    """P(X <= count): the series downward from count, or one minus that upward."""
    if count < 0:
        return mpf(0)
    if count <= rate:
        term, total, k = probability(mpf(count), rate), mpf(0), mpf(count)
        while k >= 0 and term > total * mpf(10) ** -28:
            total, term, k = total + term, term * k / rate, k - 1
        return total
    return 1 - above(count, rate)


def above(count, rate):
    """P(X > count)."""
    if count + 1 > rate:
        k = mpf(count) + 1
        term, total = probability(k, rate), mpf(0)
        while term > total * mpf(10) ** -28:
            total, k = total + term, k + 1
            term = term * rate / k
        return total
    return 1 - below(count, rate)


def quantile(rate, word):
    """The smallest k with P(X <= k) > (word + 1/2) / 2^64, by bisection about the law's expansion by Cornish and Fisher."""
    share = (mpf(word) + mpf(1) / 2) / mpf(2) ** 64
    exceeds = (lambda k: below(k, rate) > share) if share < 0.5 else (lambda k: above(k, rate) <= 1 - share)
    z = sqrt(2) * erfinv(2 * share - 1)
    guess = rate + sqrt(rate) * z + (2 + z * z) / 6
    low, high = max(mpf(-1), floor(guess) - 30), floor(guess) + 30
    assert (low < 0 or not exceeds(low)) and exceeds(high)
    while high - low > 1:
        middle = floor((low + high) / 2)
        low, high = (low, middle) if exceeds(middle) else (middle, high)
    return high


def lab(xyz, white):
    delta = mpf(6) / 29
    f = [cbrt(t) if t > delta**3 else t / (3 * delta**2) + mpf(4) / 29 for t in (a / b for a, b in zip(xyz, white))]
    return 116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])


WORDS = [0, 1, 2**32 - 1, 2**32, 2**63 - 1, 2**63, 2**64 - 2**32, 2**64 - 2, 2**64 - 1]
SWITCHES = [1e-300, 1e-20, 1e-9, 0.5, 9.999999, 10.0, 10.000001, 199.999, 200.0, 200.001, 1e4, 4194303.75, 4194304.0, 4194304.5]
print("# Made by extremes.py.")
for rate in [*SWITCHES, 1e6, 1e9]:
    rate = mpf(rate)
    for word in WORDS if rate < 1e8 else WORDS[:1] + WORDS[5:6] + WORDS[-1:]:
        print(f"quantile,{float(rate)!r} {word},{mp.nstr(quantile(rate, word), 25)}")
    for sigmas in (-6, -1, 0, 1, 6, 9):
        count = floor(rate + sigmas * sqrt(rate))
        if count >= 0:
            row("tails", [count, rate], [below(count, rate), above(count, rate)])

boltzmann_ev = mpf("1.380649e-23") / mpf("1.602176634e-19")
for kelvin in (1, 2, 5, 10, 20, 50, 100, 200, 273.15, 300, 333, 600, 1000):
    t = mpf(kelvin)
    gap = mpf("1.1557") - mpf("7.021e-4") * t**2 / (1108 + t)
    row("dark", [kelvin], [t ** mpf("1.5") * exp(-gap / (2 * boltzmann_ev * t))])
for number in (0.1, 0.5, 0.95, 8.0, 1e3, 1e6):
    row("illumination", [number], [pi / (4 * mpf(number) ** 2 + 1)])
for tangent in (0.0, 1e-9, 1e-3, 1.0, 572.957213, 1e6):
    row("vignetting", [tangent], [(1 + mpf(tangent) ** 2) ** -2])
for sigma in (1e-12, 1e-3, 0.1, 0.12, 0.2, 0.3, 0.5, 1.0):
    z = 1 / mpf(sigma)
    cumulative, density = erfc(-z / sqrt(2)) / 2, exp(-z * z / 2) / sqrt(2 * pi)
    mean = cumulative + mpf(sigma) * density
    # What rectification adds to the mean has digits of its own.
    row("rectified", [sigma], [mean, (1 + mpf(sigma) ** 2) * cumulative + mpf(sigma) * density, mean - 1])
white = [mpf(x) for x in (95.047, 100.0, 108.883)]
joint = (mpf(6) / 29) ** 3
for share in (0.0, 1e-300, 1e-12, float(joint) * (1 - 1e-12), float(joint), float(joint) * (1 + 1e-12), 0.5, 1.0, -0.01, -5.0, 1e12):
    xyz = [mpf(float(mpf(share) * w)) for w in white]
    row("lab", xyz, lab(xyz, white))
