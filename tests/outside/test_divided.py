"""Standard errors of means of frames that were divided by a flat field, beside sums over full covariance matrices by numpy."""

import json
import unittest

import numpy as np

from programs import ProgramCase

COLUMNS, ROWS = 26, 20
READOUT = {
    "width": COLUMNS, "height": ROWS, "pixel_pitch_um": 5.0, "cfa": "rggb", "full_well_e": 60000, "dark_current_e_per_s": 0,
    "temperature_k": 300, "dcnu": 0, "prnu": 0, "read_noise_e": 12.0, "bits": 14, "bias_adu": 600, "adu_per_e": 0.25,
    "row_noise_e": 9.0, "column_noise_e": 7.0,
}
LIGHT, FLAT = (3000.0, 9000.0, 14000.0), (9000.0, 12000.0, 8000.0)
DARKS, FLATS, FLAT_DARKS = 2, 2, 3
DRIFT_E = 60.0
GAIN, OFFSET_E, NOISE_E = (1.0, 1.08, 0.93, 1.04), (3.0, -20.0, 11.0, 0.0), (8.0, 14.0, 25.0, 16.0)


def taps_of(layout, y, x):
    """Which amplifier reads each photosite, of a layout and its number of them; none where there is one."""
    if layout is None:
        return np.zeros_like(x)
    lower, right = (y >= ROWS // 2).astype(int), (x >= COLUMNS // 2).astype(int)
    return {"columns": x % layout[1], "left-right": right, "top-bottom": lower, "quadrants": 2 * lower + right}[layout[0]]


class Divided(ProgramCase):
    def corrected(self, layout, rows_per_knot):
        """A frame less dark frames and divided by a flat field, as the programs make it."""
        keys = {**READOUT, "black_drift_e": DRIFT_E, "black_drift_rows": rows_per_knot}
        lines = "".join(f"  {key}: {value}\n" for key, value in keys.items())
        if layout is not None:
            name, count = layout
            of_taps = {"gain": GAIN, "offset_e": OFFSET_E, "read_noise_e": NOISE_E}
            lists = ", ".join(f"{key}: {list(value[:count])}" for key, value in of_taps.items())
            lines += f"  taps: {{layout: {name}, {lists}}}\n"
        sensor = self.directory / "sensor.yaml"
        sensor.write_text(f"schema: cyanometer-sensor/2\nname: divided\nreadout:\n{lines}", encoding="utf-8")
        number = 0

        def expose(kind, light):
            nonlocal number
            path = self.directory / f"{kind}{number}.exr"
            scene = ["--dark"] if light is None else ["--electrons", ",".join(map(str, light))]
            scene = ["render-radiance", "--sensor", sensor, *scene, "--size", f"{COLUMNS}x{ROWS}"]
            noise = ["add-noise", "--seed", "11", "--frame", str(number)]
            path.write_bytes(self.run_pipe(scene, ["mosaic"], noise, ["digitize"]))
            number += 1
            return path

        command = ["correct-frame", expose("light", LIGHT), "-o", self.directory / "corrected.exr"]
        for option, count, light in [("dark", DARKS, None), ("flat", FLATS, FLAT), ("flat-dark", FLAT_DARKS, None)]:
            for _ in range(count):
                command += [f"--{option}", expose(option, light)]
        self.run_program(command)
        return self.directory / "corrected.exr"

    def covariance(self, layout, rows_per_knot):
        """Of all quotients A⟨F⟩/F to first order, by the derivatives with respect to A and F; and the class of each."""
        y, x = np.mgrid[:ROWS, :COLUMNS]
        classes = np.array([[0, 1], [1, 2]])[y % 2, x % 2].ravel()
        tap, y, x = taps_of(layout, y, x).ravel(), y.ravel(), x.ravel()
        gain = READOUT["adu_per_e"] * (np.ones(1) if layout is None else np.array(GAIN))[tap]
        noise_e = (np.array([READOUT["read_noise_e"]]) if layout is None else np.array(NOISE_E))[tap]
        light, flat = np.array(LIGHT)[classes], np.array(FLAT)[classes]
        knot = np.floor(y / rows_per_knot).astype(int)
        angle = np.pi / 2 * (y / rows_per_knot - knot)
        knots = np.zeros((y.size, knot.max() + 2))
        knots[np.arange(y.size), knot], knots[np.arange(y.size), knot + 1] = np.cos(angle), np.sin(angle)
        shared = DRIFT_E**2 * knots @ knots.T + READOUT["row_noise_e"] ** 2 * (y[:, None] == y)
        shared += READOUT["column_noise_e"] ** 2 * (x[:, None] == x)

        def codes(electrons):
            return np.outer(gain, gain) * (np.diag(electrons + noise_e**2) + shared) + np.eye(y.size) / 12

        of_frame = codes(light) + codes(0 * light) / DARKS
        of_flat = codes(flat) / FLATS + codes(0 * flat) / FLAT_DARKS
        of_class = np.array([(classes == k) / (classes == k).sum() for k in range(3)])[classes]
        above, below = gain * light, gain * flat
        level = of_class @ below
        by_flat = np.diag(above / below) @ of_class - np.diag(above * level / below**2)
        by_frame = np.diag(level / below)
        return by_frame @ of_frame @ by_frame.T + by_flat @ of_flat @ by_flat.T, classes, (x, y)

    def test_the_errors_of_means(self):
        """Of the whole frame and of a part, behind one amplifier and several. Noise of the flat field beyond the first order is 2 ρ of its
        part of a variance, with ρ up to 6·10⁻⁴: 10⁻³ of a standard error."""
        layouts = [None, ("columns", 2), ("columns", 3), ("left-right", 2), ("top-bottom", 2), ("quadrants", 4)]
        cases = [(layout, 3.3) for layout in layouts] + [(None, 15.0), (None, 80.0), (("quadrants", 4), 15.0)]
        for layout, rows_per_knot in cases:
            path = self.corrected(layout, rows_per_knot)
            covariance, classes, (x, y) = self.covariance(layout, rows_per_knot)
            for left, top, width, height in [(0, 0, COLUMNS, ROWS), (3, 5, 18, 9)]:
                region = f"{left},{top},{width},{height}"
                done = self.run_program(["measure", path, "--region", region, "--output-format", "json"])
                found = {entry["name"]: entry for entry in json.loads(done)["regions"][0]["classes"]}
                is_here = (x >= left) & (x < left + width) & (y >= top) & (y < top + height)
                for k, name in enumerate("RGB"):
                    chosen = is_here & (classes == k)
                    own = np.sqrt(covariance[np.ix_(chosen, chosen)].sum()) / chosen.sum()
                    entry = found[name]
                    error = (entry["mean"] - entry["predicted_mean"]) / entry["z_mean"]
                    self.assertLess(abs(error / own - 1), 1.5e-3, f"{layout} {rows_per_knot} {region} {name}")


if __name__ == "__main__":
    unittest.main()
