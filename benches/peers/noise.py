"""Noise of a frame of electrons by numpy, and by the noise models of ESA's Pyxel.

numpy: five draws for each photosite, as add-noise makes: Poisson numbers of light and of dark current, and normal numbers of
PRNU, DCNU and read noise, from the default Generator (PCG64), with the full well; 32-bit floats come out.
"""

import numpy as np
import turns

DARK_E, DCNU, PRNU, READ_NOISE_E, FULL_WELL_E = 73.21, 0.2, 0.008, 15.7, 40_000.0


def expose(rates, rng):
    """One exposure of expected electrons."""
    shape = rates.shape
    charge = rng.poisson(rates) * np.maximum(rng.normal(1.0, PRNU, shape), 0.0)
    charge += rng.poisson(DARK_E, shape) * np.maximum(rng.normal(1.0, DCNU, shape), 0.0)
    np.minimum(charge, FULL_WELL_E, out=charge)
    charge += rng.normal(0.0, READ_NOISE_E, shape)
    return charge.astype(np.float32)


def plane(width, height):
    rates, rng = turns.ramp(width, height), np.random.default_rng(0)
    return lambda: expose(rates, rng)


def three(width, height):
    rates, rng = np.stack([turns.ramp(width, height)] * 3), np.random.default_rng(0)
    return lambda: expose(rates, rng)


def pyxel(width, height):
    """Pyxel's model functions on arrays: shot noise, dark current with its shot noise, PRNU, read noise.

    Its non-uniformity of dark current is one number for the whole frame, so it is left out: four draws a photosite, not
    five. It draws from numpy's older generator (Mersenne twister).
    """
    from types import SimpleNamespace

    from astropy.units import Quantity
    from pyxel.models.charge_collection.fixed_pattern_noise import compute_simple_prnu
    from pyxel.models.charge_generation.dark_current import calculate_band_gap, compute_dark_current
    from pyxel.models.charge_measurement.readout_noise import output_node_noise
    from pyxel.models.photon_collection.shot_noise import compute_poisson_noise

    rates = turns.ramp(width, height)
    temperature = Quantity(333.0, unit="K")
    dark = {
        "shape": rates.shape,
        "time_step": Quantity(0.033, unit="s"),
        "temperature": temperature,
        "pixel_area": Quantity(6.8**2, unit="um2 / pix"),
        "figure_of_merit": Quantity(0.068558, unit="nA / cm2"),
        "band_gap": calculate_band_gap(temperature=temperature, material="silicon"),
        "band_gap_room_temperature": calculate_band_gap(temperature=Quantity(300.0, unit="K"), material="silicon"),
    }

    def run():
        charge = compute_poisson_noise(rates) + compute_dark_current(**dark).value
        charge = charge * compute_simple_prnu(rates.shape, 1.0, PRNU)
        signal = SimpleNamespace(array=charge, shape=charge.shape)
        output_node_noise(SimpleNamespace(signal=signal), READ_NOISE_E)
        return signal.array

    return run


if __name__ == "__main__":
    turns.main({"plane": plane, "three": three, "pyxel": pyxel})
