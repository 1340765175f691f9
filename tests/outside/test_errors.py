"""Bad input, as a shell would give it: one line that says what is wrong, the right status, nothing left behind."""

import os
import pathlib
import resource
import signal
import stat
import subprocess
import unittest

import numpy as np
import tifffile
from astropy.io import fits
from PIL import Image

from programs import BINARIES, TIMEOUT_S, ProgramCase, read_planes, sample_data, write_planes

BAD_DATA, BAD_USAGE = 1, 2

PROGRAMS = sorted(path.stem for path in (pathlib.Path(__file__).parents[2] / "src" / "bin").iterdir())


def naming(option, value):
    """What a complaint about an option may call it."""
    return (option, option.lstrip("-"), option.lstrip("-").replace("-", " "), value)


class Errors(ProgramCase):
    def setUp(self):
        super().setUp()
        self.electrons = self.run_program(["render-radiance", "--electrons", "100,2000,3000", "--size", "16x12"])

    def listing(self):
        """What is in the directory: names, sizes and times of change."""
        return {
            str(path.relative_to(self.directory)): (path.stat().st_size, path.stat().st_mtime_ns)
            for path in self.directory.rglob("*")
        }

    def check_complaint(self, done, program, status, what):
        text = done.stderr.decode(errors="replace")
        self.assertIn(done.returncode, status if isinstance(status, tuple) else (status,), f"{what}: {text}")
        self.assertEqual(len(text.splitlines()), 1, f"{what}: {text!r}")
        self.assertTrue(text.startswith(f"{program}: "), f"{what}: {text!r}")
        self.assertTrue(text.endswith("\n"), f"{what}: {text!r}")
        self.assertNotIn("panicked", text)
        return text

    def refused(self, command, status, *mentions, stdin=b""):
        """Checks that a command is refused and gives its complaint. Of a mention that is a tuple, one word will do."""
        what = " ".join(str(word) for word in command)
        before = self.listing()
        done = self.attempt(command, stdin)
        with self.subTest(command=what):
            self.assertEqual(self.listing(), before, f"{what}: something was left behind")
            text = self.check_complaint(done, command[0], status, what)
            for mention in mentions:
                words = mention if isinstance(mention, tuple) else (mention,)
                self.assertTrue(
                    any(word.lower() in text.lower() for word in words), f"{what}: no {words} in {text!r}"
                )
        return done.stderr.decode(errors="replace")

    def write(self, name, data):
        (self.directory / name).write_bytes(data)
        return name


class Input(Errors):
    READERS = {
        "add-noise": [],
        "digitize": [],
        "mosaic": [],
        "demosaic": [],
        "measure": [],
    }

    def test_missing_file(self):
        for program, options in self.READERS.items():
            self.refused([program, "missing.exr", *options], BAD_DATA, "missing.exr")
            if program != "measure":
                self.refused([program, "missing.exr", *options, "-o", "out.exr"], BAD_DATA, "missing.exr")
        self.refused(["render-radiance", "missing.csv", "-o", "out.exr"], BAD_DATA, "missing.csv")
        self.refused(["fit-matrix", "missing.exr", "-o", "matrix.yaml"], BAD_DATA, "missing.exr")
        self.write("in.exr", self.electrons)
        self.refused(["to-xyz", "in.exr", "--matrix", "missing.yaml", "-o", "out.exr"], (1, 2), "missing.yaml")

    def test_text_named_as_an_image(self):
        for name in ("text.exr", "text.tif"):
            self.write(name, b"this is no image\n" * 50)
            for program in self.READERS:
                self.refused([program, name], BAD_DATA, name)
        self.write("text.csv", b"this is no table\n" * 50)
        self.refused(["render-radiance", "text.csv"], BAD_DATA, "text.csv")

    def test_empty_file_and_empty_pipe(self):
        self.write("empty.exr", b"")
        for program in self.READERS:
            self.refused([program, "empty.exr"], BAD_DATA, "empty.exr")
            self.refused([program], BAD_DATA)

    def test_truncated_exr(self):
        zipped = self.run_program(["add-noise", "--compression", "zip"], self.electrons)
        for data in (self.electrons, zipped):
            for length in (3, 8, 60, 400, len(data) // 2, len(data) - 200, len(data) - 1):
                self.write("cut.exr", data[:length])
                for program in ("add-noise", "measure", "mosaic"):
                    self.refused([program, "cut.exr"], BAD_DATA, "cut.exr")
                self.refused(["mosaic", "cut.exr", "-o", "out.exr"], BAD_DATA, "cut.exr")
                self.refused(["mosaic", "-o", "out.tif"], BAD_DATA, stdin=data[:length])

    def test_truncated_tiff(self):
        for compression in ("none", "lzw", "deflate"):
            data = self.run_program(["add-noise", "--format", "tiff", "--compression", compression], self.electrons)
            for length in (3, 7, 20, len(data) // 3, len(data) // 2):
                self.write("cut.tif", data[:length])
                self.refused(["mosaic", "cut.tif", "-o", "out.tif"], BAD_DATA, "cut.tif")

    def others(self):
        """Frames of other programs, of 16x12 codes."""
        chance = np.random.default_rng(78)
        codes = chance.integers(0, 4096, (12, 16)).astype(np.uint16)
        Image.fromarray(codes).save(self.directory / "whole.png")
        Image.fromarray((codes >> 4).astype(np.uint8)).convert("RGB").save(self.directory / "whole8.png")
        image = fits.PrimaryHDU(codes)
        image.header["BAYERPAT"] = "RGGB"
        image.writeto(self.directory / "whole.fits", overwrite=True)
        part = fits.ImageHDU(np.stack([codes] * 3).astype(np.float32))
        fits.HDUList([fits.PrimaryHDU(), part]).writeto(self.directory / "whole3.fits", overwrite=True)
        array = [(33421, "H", 2, (2, 2), True), (33422, "B", 4, b"\0\1\1\2", True)]
        tifffile.imwrite(self.directory / "whole.tif", codes, photometric="cfa", extratags=array, metadata=None)
        return {path.name: path.read_bytes() for path in sorted(self.directory.glob("whole*"))}

    def test_truncated_frames_of_others(self):
        for name, data in self.others().items():
            suffix = name.rpartition(".")[2]
            options = ["--part", "1"] if name == "whole3.fits" else []
            # Behind the samples of a FITS stand bytes that fill the last block, behind those of a PNG its end.
            end = {"fits": len(data) - 2880, "png": len(data) - 40, "tif": len(data) - 30}[suffix]
            for length in (3, 9, 40, len(data) // 2, end):
                self.write(f"cut.{suffix}", data[:length])
                for program in ("mosaic", "measure"):
                    self.refused([program, f"cut.{suffix}", *options], BAD_DATA, f"cut.{suffix}")
                    self.refused([program, *options], BAD_DATA, "standard input", stdin=data[:length])

    def test_flipped_bytes_never_crash(self):
        chance = np.random.default_rng(77)
        files = {
            "a.exr": self.run_program(["add-noise", "--compression", "piz"], self.electrons),
            "b.exr": self.run_program(["add-noise", "--compression", "zip"], self.electrons),
            "c.tif": self.run_program(["add-noise", "--format", "tiff", "--compression", "lzw"], self.electrons),
            **self.others(),
        }
        for name, data in files.items():
            for _ in range(40):
                spoiled = bytearray(data)
                for place in chance.integers(0, len(data), 3):
                    spoiled[place] = chance.integers(0, 256)
                self.write(name, bytes(spoiled))
                program = "measure" if name.startswith("whole") else "mosaic"
                done = self.attempt([program, name])
                self.assertIn(done.returncode, (0, 1), f"{name}: {done.stderr!r}")
                self.assertNotIn(b"panicked", done.stderr)

    def test_file_name_that_is_no_text(self):
        name = os.fsencode(self.path("")) + b"sky\xff.exr"
        try:
            pathlib.Path(os.fsdecode(name)).write_bytes(self.electrons)
        except OSError:
            self.skipTest("this file system wants names to be text")
        done = self.attempt(["add-noise", os.fsdecode(name), "-o", "out.exr"])
        self.assertEqual((done.returncode, done.stderr), (0, b""))

    @unittest.skipUnless(os.path.exists("/dev/zero"), "there is no endless device")
    def test_input_that_never_ends(self):
        self.write("in.exr", self.electrons)
        self.refused(["render-radiance", "/dev/zero"], BAD_DATA, "/dev/zero")
        self.refused(["render-radiance", "--dark", "--sensor", "/dev/zero"], BAD_DATA, "/dev/zero")
        self.refused(["measure", "in.exr", "--metadata", "/dev/zero"], BAD_DATA, "/dev/zero")
        self.refused(["to-xyz", "in.exr", "--matrix", "/dev/zero"], BAD_DATA, "/dev/zero")

    def test_directory_as_input(self):
        (self.directory / "folder.exr").mkdir()
        self.refused(["measure", "folder.exr"], BAD_DATA, "folder.exr")

    def test_bad_spectra(self):
        rows = "\n".join(f"{nm},1e-6" for nm in range(360, 831))
        for name, text in {
            "no-rows.csv": "wavelength_nm,radiance_w_per_cm2_sr_nm\n",
            "word.csv": "wavelength_nm,radiance_w_per_cm2_sr_nm\n" + rows.replace("400,1e-6", "400,much"),
            "ragged.csv": "wavelength_nm,radiance_w_per_cm2_sr_nm\n" + rows.replace("400,1e-6", "400"),
            "disorder.csv": "wavelength_nm,radiance_w_per_cm2_sr_nm\n" + rows.replace("400,1e-6", "500,1e-6"),
            "not-a-number.csv": "wavelength_nm,radiance_w_per_cm2_sr_nm\n" + rows.replace("400,1e-6", "400,nan"),
        }.items():
            self.write(name, text.encode())
            self.refused(["render-radiance", name, "--size", "4x4", "-o", "out.exr"], BAD_DATA, name)


class Stages(Errors):
    def test_demosaic_of_planes_names_mosaic(self):
        self.write("electrons.exr", self.electrons)
        self.refused(["demosaic", "electrons.exr", "-o", "out.exr"], BAD_DATA, "electrons.exr", "mosaic")
        text = self.refused(["demosaic"], BAD_DATA, "mosaic", stdin=self.electrons)
        self.assertIn("mosaic", text.removeprefix("demosaic: ").replace("demosaic", ""))

    def test_to_xyz_of_a_cfa_plane_names_demosaic(self):
        sky = sample_data("skies/sky912.exr")
        self.run_program(["fit-matrix", sky, "--sensor", "kaf-5101ce", "-o", "matrix.yaml"])
        cfa = self.run_pipe(["add-noise"], ["digitize"], ["mosaic"], stdin=self.electrons)
        self.write("cfa.exr", cfa)
        self.refused(
            ["to-xyz", "cfa.exr", "--matrix", "matrix.yaml", "-o", "out.exr"], BAD_DATA, "cfa.exr", "demosaic"
        )

    def test_digitize_of_adu(self):
        self.write("codes.exr", self.run_pipe(["add-noise"], ["digitize"], stdin=self.electrons))
        self.refused(["digitize", "codes.exr", "-o", "out.exr"], BAD_DATA, "codes.exr")

    def test_noise_on_adu(self):
        self.write("codes.exr", self.run_pipe(["add-noise"], ["digitize"], stdin=self.electrons))
        self.refused(["add-noise", "codes.exr", "-o", "out.exr"], BAD_DATA, "codes.exr")

    def test_mosaic_of_a_plane(self):
        self.write("cfa.exr", self.run_program(["mosaic"], self.electrons))
        self.refused(["mosaic", "cfa.exr", "-o", "out.exr"], BAD_DATA, "cfa.exr")

    def test_plane_without_a_pattern(self):
        write_planes(self.path("plane.tif"), {"Y": np.ones((6, 6), np.uint16)}, "u16")
        self.refused(["demosaic", "plane.tif", "--black", "none"], (1, 2), "plane.tif", "--cfa")


class SmallFrames(Errors):
    def test_one_photosite_and_one_column(self):
        for size, shape in [("1x1", (1, 1)), ("1x7", (7, 1)), ("7x1", (1, 7))]:
            self.run_program(["render-radiance", "--electrons", "100,200,300", "--size", size, "-o", "e.exr"])
            self.run_program(["add-noise", "e.exr", "--seed", "1", "-o", "n.exr"])
            self.run_program(["digitize", "n.exr", "-o", "d.tif"])
            self.run_program(["mosaic", "d.tif", "-o", "m.exr"])
            for name in ("e.exr", "n.exr", "d.tif", "m.exr"):
                self.assertEqual(next(iter(read_planes(self.path(name)).values())).shape, shape)
                self.run_program(["measure", name])
                self.run_program(["measure", name, "--output-format", "json"])
            self.refused(["demosaic", "m.exr", "-o", "out.exr"], BAD_DATA, "m.exr")
            for name in ("e.exr", "n.exr", "d.tif", "m.exr"):
                os.remove(self.path(name))
                os.remove(self.path(name + ".yaml"))


class Usage(Errors):
    def test_numbers_out_of_range(self):
        light = ["render-radiance", "--electrons", "1,2,3", "--size", "4x4", "-o", "out.exr"]
        for option, value in [
            ("--exposure", "-1"),
            ("--exposure", "nan"),
            ("--exposure", "inf"),
            ("--f-number", "0"),
            ("--f-number", "-8"),
            ("--lens-transmittance", "-0.1"),
            ("--lens-transmittance", "1.5"),
            ("--exposure", "soon"),
            ("--quadrature", "guess"),
            ("--cfa", "xyzw"),
        ]:
            self.refused([*light, f"{option}={value}"], BAD_USAGE, naming(option, value))
        sky = sample_data("skies/clear_zenith.csv")
        for option, value in [
            ("--wavelengths", "830:360:1"),
            ("--wavelengths", "360:830:0"),
            ("--wavelengths", "360:830:-1"),
            ("--wavelengths", "360:830:nan"),
            ("--wavelengths", "360:830:1e-9"),
            ("--wavelengths", "360"),
            ("--expose-to", "0"),
            ("--expose-to", "-1"),
            ("--expose-to", "nan"),
        ]:
            self.refused(
                ["render-radiance", sky, "--size", "4x4", "-o", "out.exr", f"{option}={value}"],
                *(BAD_USAGE, naming(option, value)),
            )
        for size in ("0x5", "5x0", "-1x5", "5", "5x", "axb", "99999999999999999999x2"):
            self.refused(
                ["render-radiance", "--electrons", "1,2,3", f"--size={size}", "-o", "out.exr"],
                *(BAD_USAGE, naming("--size", size)),
            )
        for electrons in ("1,2", "1,2,3,4", "1,2,-3", "a,b,c", "1,2,nan"):
            self.refused(
                ["render-radiance", f"--electrons={electrons}", "--size", "4x4", "-o", "out.exr"],
                *(BAD_USAGE, naming("--electrons", electrons)),
            )

    def test_noise_and_converter_options(self):
        self.write("in.exr", self.electrons)
        for option, value in [
            ("--seed", "-1"),
            ("--seed", "seven"),
            ("--temperature", "-5"),
            ("--temperature", "nan"),
            ("--without", "rain"),
            ("--threads", "-2"),
        ]:
            self.refused(["add-noise", "in.exr", "-o", "out.exr", f"{option}={value}"], BAD_USAGE, naming(option, value))
        for option, value in [("--bits", "0"), ("--bits", "99"), ("--slope", "-1"), ("--slope", "nan")]:
            self.refused(["digitize", "in.exr", "-o", "out.exr", f"{option}={value}"], BAD_USAGE, naming(option, value))
        self.refused(["mosaic", "in.exr", "-o", "out.exr", "--pattern=rgbw"], BAD_USAGE, "rgbw")
        self.refused(["mosaic", "in.exr", "-o", "out.exr", "--compression=best"], BAD_USAGE, "best")
        self.refused(["mosaic", "in.exr", "-o", "out.tif", "--compression=piz"], BAD_USAGE, ("piz", "compress"))
        self.refused(["mosaic", "in.exr", "-o", "out.exr", "--sample-type=u16"], BAD_USAGE, ("u16", "f16"))
        self.refused(["measure", "in.exr", "--region", "0,0,17,1"], (1, 2), "0,0,17,1")
        self.refused(["measure", "in.exr", "--region", "0,0,0,1"], (1, 2), "0,0,0,1")

    def test_unknown_option_and_missing_source(self):
        of_several = {
            "add-noise", "average-frames", "correct-frame", "demosaic", "digitize", "import-raw", "measure", "mosaic", "stack-frames",
            "to-xyz",
        }
        for program in PROGRAMS:
            self.refused([program, "--colour-of-the-sky"], BAD_USAGE, "--colour-of-the-sky")
            if program not in of_several:
                self.refused([program, "a", "b", "c", "d"], BAD_USAGE)
        self.refused(["render-radiance", "--size", "4x4", "--dark", "--electrons", "1,2,3"], BAD_USAGE)

    def test_negative_counts_are_values(self):
        for command in (
            *(["add-noise", option, "-1"] for option in ("--seed", "--sensor-seed", "--frame", "--part")),
            *(["render-radiance", option, "-1"] for option in ("--sample", "--part")),
            ["measure", "--region", "-1,0,2,2"],
        ):
            self.refused(command, BAD_USAGE, f"`{command[2]}` is no value for {command[1]}", stdin=self.electrons)

    def test_half_does_not_become_infinite(self):
        self.run_program(["render-radiance", "--electrons", "65504,1,1", "--size", "4x4", "--sample-type", "f16"])
        for options in ([], ["-o", "out.exr"]):
            bright = ["render-radiance", "--electrons", "70000,1,1", "--size", "4x4", "--sample-type", "f16"]
            self.refused([*bright, *options], BAD_DATA, "65504")

    def test_exposure_that_no_number_can_hold(self):
        sky = sample_data("skies/clear_zenith.csv")
        self.refused(["render-radiance", sky, "--expose-to", "1e308", "--size", "2x2"], (1, 2), "exposure")

    def test_unknown_sensor(self):
        self.refused(
            ["render-radiance", "--electrons", "1,2,3", "--size", "4x4", "--sensor", "kaf-1501", "-o", "out.exr"],
            *((BAD_DATA, BAD_USAGE), "kaf-1501"),
        )

    def test_sensor_file_with_a_misspelled_key(self):
        for name in ("kaf-5101ce.yaml", "kaf5101ce_est_qe_1nm.csv", "bg39_1mm.csv"):
            self.write(name, sample_data(f"sensors/{name}").read_bytes())
        light = ["render-radiance", "--electrons", "1,2,3", "--size", "4x4", "-o", "out.exr", "--sensor"]
        text = (self.directory / "kaf-5101ce.yaml").read_text(encoding="utf-8")
        for right, wrong in [("read_noise_e", "read_nois_e"), ("prnu", "pnru"), ("full_well_e", "fullwell_e")]:
            self.write("sensor.yaml", text.replace(f"\n{right}:", f"\n{wrong}:").encode())
            self.refused([*light, "./sensor.yaml"], BAD_DATA, "sensor.yaml", wrong, right)
        self.write("sensor.yaml", (text + "read_noise: 3\n").encode())
        self.refused([*light, "./sensor.yaml"], BAD_DATA, "sensor.yaml", "read_noise_e")
        for key, value in [("bits", "0"), ("read_noise_e", "-1"), ("prnu", ".nan"), ("cfa", "rgbw")]:
            lines = [f"{key}: {value}" if line.startswith(f"{key}:") else line for line in text.splitlines()]
            self.write("sensor.yaml", "\n".join(lines).encode())
            self.refused([*light, "./sensor.yaml"], BAD_DATA, "sensor.yaml", key)

    def test_help_and_version_succeed(self):
        for program in PROGRAMS:
            # The front door works on nothing itself.
            option = b"--help" if program == "cyanometer" else b"--threads"
            self.assertIn(option, self.run_program([program, "--help"]))
            self.assertTrue(self.run_program([program, "--version"]).startswith(program.encode() + b" "))


class Output(Errors):
    def test_directory_missing(self):
        self.write("in.exr", self.electrons)
        for name in ("nowhere/out.exr", "nowhere/out.tif"):
            self.refused(["add-noise", "in.exr", "-o", name], BAD_DATA, "nowhere")
            self.refused(["add-noise", "-o", name], BAD_DATA, "nowhere", stdin=self.electrons)

    def test_output_is_a_directory(self):
        (self.directory / "folder.exr").mkdir()
        self.refused(["add-noise", "-o", "folder.exr"], BAD_DATA, "folder.exr", stdin=self.electrons)

    @unittest.skipIf(os.geteuid() == 0, "the superuser may write anywhere")
    def test_read_only_directory(self):
        folder = self.directory / "folder"
        folder.mkdir(mode=0o500)
        self.refused(["add-noise", "-o", "folder/out.exr"], BAD_DATA, "folder/out.exr", stdin=self.electrons)

    def test_input_is_output(self):
        self.write("same.exr", self.electrons)
        (self.directory / "folder").mkdir()
        os.symlink("same.exr", self.path("link.exr"))
        os.link(self.path("same.exr"), self.path("hard.exr"))
        for name in ("same.exr", "./same.exr", "folder/../same.exr", self.path("same.exr"), "link.exr", "hard.exr"):
            self.refused(["add-noise", "same.exr", "-o", name], (1, 2), (name, "same.exr"))
        self.assertEqual((self.directory / "same.exr").read_bytes(), self.electrons)

    def test_no_input_is_written_over(self):
        self.write("in.exr", self.electrons)
        self.refused(["measure", "in.exr", "-o", "in.exr"], BAD_USAGE, "in.exr")
        sky = self.write("sky.csv", sample_data("skies/clear_zenith.csv").read_bytes())
        self.refused(["render-radiance", sky, "--size", "4x4", "--format", "exr", "-o", sky], BAD_USAGE, sky)
        library = self.write("library.exr", sample_data("skies/sky912.exr").read_bytes())
        self.refused(["fit-matrix", library, "-o", library], BAD_USAGE, library)
        self.run_program(["fit-matrix", library, "-o", "matrix.yaml"])
        self.refused(
            ["to-xyz", "in.exr", "--matrix", "matrix.yaml", "--format", "exr", "-o", "matrix.yaml"],
            BAD_USAGE,
            "matrix.yaml",
        )

    def test_report_goes_into_a_named_pipe(self):
        self.write("in.exr", self.electrons)
        os.mkfifo(self.path("pipe"))
        with subprocess.Popen(["cat", self.path("pipe")], stdout=subprocess.PIPE) as reader:
            try:
                self.run_program(["measure", "in.exr", "-o", "pipe"])
                self.assertTrue(stat.S_ISFIFO(os.stat(self.path("pipe")).st_mode), "it was replaced by a file")
                self.assertIn(b"16x12", reader.stdout.read())
            finally:
                reader.kill()

    def test_disk_that_fills_up_with_the_sidecar(self):
        # A disk of our own, so small that for one of these heights the frame still fits but its sidecar does not.
        mount = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"]
        script = (
            "mkdir -p disk && mount -t tmpfs -o size=200k none disk || exit 99; for rows in 124 125 126 127 128 129; do "
            '"$0" --dark --size 130x$rows -o disk/out.exr; echo $? $(ls -A disk); rm -f disk/*; done'
        )
        try:
            done = subprocess.run(
                [*mount, script, str(BINARIES / "render-radiance")],
                capture_output=True, cwd=self.directory, timeout=TIMEOUT_S, check=False,
            )
        except FileNotFoundError:
            self.skipTest("there is no unshare")
        if done.returncode != 0:
            self.skipTest("no disk may be mounted here")
        lines = set(done.stdout.decode().split("\n")) - {""}
        self.assertEqual(lines, {"0 out.exr out.exr.yaml", "1"}, done.stderr)

    def test_earlier_output_survives_an_error(self):
        self.write("out.exr", b"precious")
        self.write("cut.exr", self.electrons[:-10])
        self.refused(["add-noise", "cut.exr", "-o", "out.exr"], BAD_DATA, "cut.exr")
        self.assertEqual((self.directory / "out.exr").read_bytes(), b"precious")

    def test_unknown_suffix(self):
        self.refused(["add-noise", "-o", "out.jpeg"], (BAD_DATA, BAD_USAGE), ".jpeg", stdin=self.electrons)

    def full_device(self):
        """A device that is always full: our own if we may make one, so that a program that replaces its output cannot
        harm the machine."""
        path = self.directory / "full"
        try:
            os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, 7))
            with open(path, "wb", buffering=0) as file:
                file.write(b"x")
        except PermissionError:
            path.unlink(missing_ok=True)
            if os.geteuid() == 0 or not os.path.exists("/dev/full"):
                self.skipTest("there is no full device that is safe to try")
            return pathlib.Path("/dev/full")
        except OSError:
            pass
        return path

    def test_full_disk(self):
        full = self.full_device()
        large = self.run_program(["render-radiance", "--electrons", "100,2000,3000", "--size", "700x400"])
        for data in (self.electrons, large):
            for options in ([], ["--format", "tiff"]):
                for program in ("add-noise", "mosaic"):
                    self.refused([program, *options, "-o", full], BAD_DATA, "full", stdin=data)
                    self.assertTrue(stat.S_ISCHR(os.stat(full).st_mode), "the device was replaced by a file")
                    with open(full, "wb") as sink:
                        done = subprocess.run(
                            [str(BINARIES / program), *options],
                            input=data,
                            stdout=sink,
                            stderr=subprocess.PIPE,
                            cwd=self.directory,
                            timeout=TIMEOUT_S,
                            check=False,
                        )
                    self.check_complaint(done, program, BAD_DATA, f"{program} > full")
        self.write("in.exr", self.electrons)
        with open(full, "wb") as sink:
            done = subprocess.run(
                [str(BINARIES / "measure"), "in.exr"],
                stdout=sink, stderr=subprocess.PIPE, cwd=self.directory, timeout=TIMEOUT_S, check=False,
            )
        self.check_complaint(done, "measure", BAD_DATA, "measure > full")

    def test_tallest_frame_starts_at_once(self):
        # Its table of rows alone has 16 GiB: it has to stream too.
        limit = (1 << 30, 1 << 30)
        with subprocess.Popen(
            [str(BINARIES / "render-radiance"), "--dark", "--threads", "1", "--size", f"1x{(1 << 31) - 1}"],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=self.directory,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limit),
        ) as program:
            try:
                head = program.stdout.read(1 << 20)
                program.stdout.close()
                self.assertEqual(len(head), 1 << 20, program.stderr.read())
                self.assertEqual(program.wait(timeout=TIMEOUT_S), 0)
                # What such a header announces is not kept in memory either.
                endless = head + bytes(64 << 20)
            finally:
                program.kill()
        done = subprocess.run(
            [str(BINARIES / "measure"), "--threads", "1"], input=endless, capture_output=True, timeout=TIMEOUT_S,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (1 << 26, 1 << 26)), check=False,
        )
        self.check_complaint(done, "measure", BAD_DATA, "a table that is cut short")

    def test_closed_pipe_is_no_error(self):
        for command, data in [
            (["render-radiance", "--electrons", "100,2000,3000", "--size", "900x700"], b""),
            (["add-noise", "in.exr"], None),
            (["mosaic", "in.exr", "--format", "tiff"], None),
        ]:
            if data is None and not (self.directory / "in.exr").exists():
                large = self.run_program(["render-radiance", "--electrons", "100,2000,3000", "--size", "900x700"])
                self.write("in.exr", large)
            program = subprocess.Popen(
                [str(BINARIES / command[0]), *command[1:]],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=self.directory,
            )
            self.assertEqual(len(program.stdout.read(100)), 100)
            program.stdout.close()
            try:
                complaint = program.stderr.read()
                status = program.wait(timeout=TIMEOUT_S)
            finally:
                program.stderr.close()
                if program.poll() is None:
                    program.kill()
                    program.wait()
            self.assertEqual((status, complaint), (0, b""), " ".join(command))

    def test_interrupt_leaves_nothing(self):
        # The program waits for the rest of its input when it is interrupted.
        for number in (2, 15):
            before = self.listing()
            program = subprocess.Popen(
                [str(BINARIES / "add-noise"), "-o", "out.exr"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=self.directory,
                # Shells start what runs in the background with SIGINT ignored, which is inherited.
                preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            )
            try:
                program.stdin.write(self.electrons[:-100])
                program.stdin.flush()
                for _ in range(100):
                    if self.listing() != before:
                        break
                    try:
                        program.wait(timeout=0.01)
                        break
                    except subprocess.TimeoutExpired:
                        pass
                program.send_signal(number)
                program.wait(timeout=10)
            finally:
                if program.poll() is None:
                    program.kill()
                    program.wait()
                program.stdin.close()
                program.stdout.close()
                program.stderr.close()
            self.assertEqual(program.returncode, -number)
            self.assertEqual(self.listing(), before, f"signal {number}")
