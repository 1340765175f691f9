"""Sweeps: the same bytes however ranges are cut and whatever was killed, mistakes in plain words, errors that are what they say.

Snakemake runs with the programs of CYANOMETER_BIN; where it is not installed its tests are skipped, and say so.
"""

import base64
import contextlib
import csv
import importlib.util
import io
import os
import pathlib
import random
import signal
import subprocess
import sys
import time
import unittest
import unittest.mock

from programs import BINARIES, ROOT, SAMPLE_DATA, ProgramCase

WORKFLOW = ROOT / "workflow"
NEEDED = ("snakemake", "pyarrow", "matplotlib", "blake3")
MISSING = [name for name in NEEDED if importlib.util.find_spec(name) is None]
WITHOUT = f"not installed: {', '.join(MISSING)}; pip install -r workflow/requirements.txt"

SWEEP = """
schema: cyanometer-sweep/1
output: out.csv
plots: svg
seed: 7
frames: 800
frames_per_job: {frames_per_job}
size: 12x12
matrix: sample_data/skies/sky912.exr
stages: [adu, xyz]
sweep:
  sensor: kaf-5101ce
  exposure_s: 0.01
  temperature_k: 280
  sky: sample_data/skies/clear_zenith.csv
  method: bi
keep:
  stage: adu
  frames: [3, 498, 499, 500, 501, 799]
"""


def setUpModule():
    sys.path.insert(0, str(WORKFLOW))
    os.environ["PATH"] = f"{BINARIES}:{os.environ['PATH']}"


class SweepCase(ProgramCase):
    """A directory with sample_data in it, and sweeps there."""

    def setUp(self):
        super().setUp()
        (self.directory / "sample_data").symlink_to(SAMPLE_DATA)

    def place(self, name, frames_per_job):
        """A directory of its own for a sweep."""
        place = self.directory / name
        place.mkdir()
        (place / "sample_data").symlink_to(SAMPLE_DATA)
        (place / "sweep.yaml").write_text(SWEEP.format(frames_per_job=frames_per_job))
        return place

    def snakemake(self, place, *options):
        """The command and where it runs."""
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(WORKFLOW / "Snakefile"), "--cores", "2"]
        return {"args": [*command, "--config", "sweep=sweep.yaml", *options], "cwd": place, "env": self.environment()}

    def environment(self):
        # A cache of its own: Snakemake keeps sources in the home.
        return {**os.environ, "XDG_CACHE_HOME": str(self.directory / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}

    def run_sweep(self, place, *options):
        """Runs a sweep that should succeed; gives what was said."""
        done = subprocess.run(
            **self.snakemake(place, *options), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
        )
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout


@unittest.skipIf(MISSING, WITHOUT)
class SameBytes(SweepCase):
    """One job, two, and two of which one was killed."""

    def test_cut_and_killed_sweeps_have_the_same_bytes(self):
        one = self.place("one", 1000)
        self.run_sweep(one)
        two = self.place("two", 500)
        running = subprocess.Popen(
            **self.snakemake(two, "--cores", "1"),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        parts = self.complete_parts(two, running)
        time.sleep(0.5)  # into the next job
        os.killpg(running.pid, signal.SIGKILL)
        running.wait()
        self.assertFalse((two / "out.csv").exists())
        before = {part: part.stat().st_mtime_ns for part in parts}
        self.run_sweep(two, "--nolock")
        after = {part: part.stat().st_mtime_ns for part in parts}
        self.assertEqual(before, after, "a complete range was made again")
        checksums = (one / "out.b3").read_text()
        self.assertEqual(checksums, (two / "out.b3").read_text())
        self.assertEqual(len(checksums.splitlines()), 2 + 2 + 2 * 6)  # table, summary, figures, frames with sidecars
        self.rows_are_frames(one)
        self.kept_frames_are_those_of_one_command(one)
        self.assertIn("Nothing to be done", self.run_sweep(two, "--nolock"))

    def is_under_way(self, place, part):
        """Whether Snakemake has not noted yet that a file is complete: its marks are named by the path in base 64."""
        marks = (place / ".snakemake" / "incomplete").glob("**/*")
        return any(part.name.encode() in base64.b64decode(mark.name + "==", b"-_") for mark in marks)

    def complete_parts(self, place, running):
        """The ranges that are complete, and known as such to Snakemake, once there are any."""
        for _ in range(1200):
            parts = list(place.glob("out-work/*/0*.parquet"))
            if parts and not any(self.is_under_way(place, part) for part in parts):
                return parts
            self.assertIsNone(running.poll(), "it ended before it could be killed")
            time.sleep(0.05)
        self.fail("no range within a minute")

    def rows_are_frames(self, place):
        """A row for each frame, in order; no path and no host in any."""
        with (place / "out.csv").open() as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([int(row["frame"]) for row in rows], list(range(800)))
        self.assertEqual({row["temperature_k"] for row in rows}, {"280"})
        self.assertEqual({row["sky"] for row in rows}, {"clear_zenith"})
        self.assertTrue(all(float(row["xyz_Y_mean_cd_per_m2"]) > 0 for row in rows))

    def kept_frames_are_those_of_one_command(self, place):
        """A frame that was kept has the bytes that its number and the table's seed give."""
        with (place / "out.csv").open() as file:
            row = next(csv.DictReader(file))
        scene = next((place / "out-work/scenes").glob("*.exr")).read_bytes()
        seed = ["--seed", row["seed"], "--sensor-seed", row["sensor_seed"], "--temperature", "280.0", "--frame", "500"]
        expected = self.run_pipe(["add-noise", *seed], ["digitize"], stdin=scene)
        kept = next((place / "out-frames").glob("*/adu-0000000500.exr"))
        self.same_planes(self.planes(kept.read_bytes()), self.planes(expected))


class Pins(unittest.TestCase):
    """What the tests run is what users are told to install."""

    def test_the_same_versions(self):
        wanted, tested = ((path / "requirements.txt").read_text().split() for path in (WORKFLOW, ROOT / "tests/outside"))
        self.assertEqual([line for line in wanted if line not in tested and "slurm" not in line], [])


@unittest.skipIf(MISSING, WITHOUT)
class Given(SweepCase):
    """What results hang on, besides the sweep itself."""

    def test_tables_that_a_sensor_file_names_count(self):
        from sweep import files

        (self.directory / "qe.csv").write_text("wavelength_nm,R,G,B\n400,1,1,1\n700,1,1,1\n")
        sensor = self.directory / "s.yaml"
        sensor.write_text("response:\n  quantum_efficiency: {file: qe.csv}\n  cover_glass: {file: not-here.csv}\n")
        self.assertEqual(files.of_sensor(sensor), [str(sensor), str(self.directory / "qe.csv")])
        self.assertEqual(files.of_sensor(pathlib.Path("kaf-5101ce")), [])


@unittest.skipIf(MISSING, WITHOUT)
class Mistakes(SweepCase):
    """What is wrong with a sweep is told before anything runs."""

    def told(self, text):
        from sweep import plan
        from sweep.mistakes import Mistakes as Told

        (self.directory / "sweep.yaml").write_text(text)
        with contextlib.chdir(self.directory), self.assertRaises(Told) as raised:
            plan.read("sweep.yaml")
        return raised.exception.told

    def changed(self, old, new):
        text = SWEEP.format(frames_per_job=500)
        self.assertIn(old, text)
        return self.told(text.replace(old, new))

    def test_each_mistake_has_its_line_and_words(self):
        at = {line.split(":")[0].strip(): n + 1 for n, line in enumerate(SWEEP.splitlines())}
        for old, new, key, words in (
            ("frames_per_job: 500", "frames_per_job: 499", "frames_per_job", "out of range; it lies within 500 and 5000"),
            ("frames_per_job: 500", "frames_per_job: 5001", "frames_per_job", "out of range; it lies within 500 and 5000"),
            ("seed: 7", "seed: seven", "seed", "a whole number is wanted"),
            ("seed: 7", "sead: 7", "seed", "did you mean `seed`?"),
            ("frames: 800", "frames: 0", "frames", "at least one frame"),
            ("size: 12x12", "size: 13x12", "size", "each even"),
            ("out.csv", "out.xls", "output", "neither .parquet nor .csv"),
            ("sensor: kaf-5101ce", "sensor: kaf-5101", "sensor", "did you mean `kaf-5101ce`?"),
            ("sensor: kaf-5101ce", "sensor: imx219", "sensor", "has no response"),
            ("exposure_s: 0.01", "exposure_s: []", "exposure_s", "nothing would be swept"),
            ("exposure_s: 0.01", "exposure_s: -1", "exposure_s", "out of range; it is above 0"),
            ("exposure_s: 0.01", "exposure_s: .nan", "exposure_s", "out of range; it is above 0"),
            ("temperature_k: 280", "temperature_k: [280, 280.0]", "temperature_k", "stands twice"),
            ("sky: sample_data/skies/clear_zenith.csv", "sky: no.csv", "sky", "there is no file no.csv"),
            ("method: bi", "method: bilinear", "method", "is unknown"),
            ("stages: [adu, xyz]", "stages: [adu, lab]", "stages", "white_luminance_cd_per_m2"),
            ("799]", "800]", "frames", "not among the frames"),
        ):
            with self.subTest(new):
                told = self.changed(old, new)
                self.assertTrue(any(words in line for line in told), told)
                self.assertTrue(all(line.startswith("sweep.yaml:") for line in told), told)
                lines = {int(line.split(":")[1]) for line in told}
                if key != "frames":
                    self.assertIn(at[key], lines, told)

    def test_all_mistakes_are_told_at_once(self):
        text = SWEEP.format(frames_per_job=1).replace("seed: 7", "seed: x").replace("method: bi", "method: x")
        self.assertEqual(len(self.told(text)), 3)

    def test_no_job_starts(self):
        place = self.place("wrong", 1)
        done = subprocess.run(**self.snakemake(place), capture_output=True, text=True, check=False)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("sweep.yaml:7: frames_per_job: 1 is out of range", done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        self.assertFalse((place / "out-work").exists())


@unittest.skipIf(MISSING, WITHOUT)
class Errors(unittest.TestCase):
    """The sampling errors of the summary are those of a simulation that shares a fixed pattern among its frames."""

    def test_errors_of_means_and_variances(self):
        from sweep import summary

        pixels, frames, trials, sigma_f, sigma_t = 40, 8, 1500, 0.8, 0.6
        chance, z_means, z_variances = random.Random(5), summary.Moments(), summary.Moments()
        for _ in range(trials):
            fixed = [chance.gauss(0, sigma_f) for _ in range(pixels)]
            found = summary.Gathered(predicted=(0.0, 1.0), errors=(pixels**-0.5, (2 * (pixels - 1)) ** -0.5), pixels=pixels)
            for _ in range(frames):
                one = summary.Moments()
                one.add([value + chance.gauss(0, sigma_t) for value in fixed])
                found.mean.add([one.mean])
                found.variance.add([one.squares / (pixels - 1)])
            row = summary.tested(found, sigma_f**2)
            z_means.add([row["z_mean"]])
            z_variances.add([row["z_variance"]])
        # A standard deviation of 1500 normal deviates is known to 1/sqrt(2 * 1499) = 0.018, a mean to 0.026; five of these.
        for deviates in (z_means, z_variances):
            self.assertAlmostEqual(deviates.spread, 1, delta=0.09)
            self.assertAlmostEqual(deviates.mean, 0, delta=0.13)

    def test_cuts_change_no_bit(self):
        from sweep import summary

        values = [random.Random(n).gauss(1e6, 1) for n in range(1000)]
        forward, backward = summary.Moments(), summary.Moments()
        forward.add(values)
        backward.add(values[::-1])
        self.assertEqual(forward, backward)


@unittest.skipIf(MISSING, WITHOUT)
class Reports(unittest.TestCase):
    """A report that is not that of its range is refused."""

    def test_a_missing_frame(self):
        from sweep import reports

        head = "x,y,width,height,channel,count,mean,std,min,max,snr_db,clipped,predicted_mean,predicted_std,z_mean,z_std,mean_error,std_error,file,frame"
        rows = [f"0,0,8,8,{c},16,1,1,1,1,1,0,1,1,0,0,1,1,standard input,{f}" for f in (0, 2) for c in "YRGB"]
        text = io.BytesIO("\n".join([head, *rows]).encode())
        with unittest.mock.patch("pyarrow.csv.read_csv", lambda path, **options: _read_csv(text, **options)):
            with self.assertRaisesRegex(ValueError, "channel R has not the frames 0..2"):
                reports.read(pathlib.Path("nowhere"), ("adu",), range(2))


def _read_csv(text, **options):
    import pyarrow as pa

    text.seek(0)
    return pa.csv.open_csv(text, **options).read_all()


if __name__ == "__main__":
    unittest.main()
