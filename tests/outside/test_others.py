"""Frames of other programs: TIFF by tifffile, PNG by Pillow and OpenImageIO, FITS by astropy, bare samples by numpy."""

import json
import unittest
import warnings

import numpy as np
import tifffile
from astropy.io import fits
from PIL import Image, PngImagePlugin, TiffImagePlugin

from programs import ProgramCase, mosaic, oiiotool, write_planes

BAD_DATA, BAD_USAGE = 1, 2

BI = ["demosaic", "--method", "bi"]


class Others(ProgramCase):
    def setUp(self):
        super().setUp()
        self.chance = np.random.default_rng(3)

    def codes(self, shape=(23, 37), most=4096):
        return self.chance.integers(0, most, shape).astype(np.uint16)

    def read(self, path, options=()):
        """The planes that a program sees, from a file and down a pipe."""
        # Nothing is drawn, and colors that are XYZ stay what they are: a map of differences would not do.
        report = json.loads(self.run_program(["measure", path, *options, "--output-format", "json"]))
        piped = self.run_program(["measure", *options, "--output-format", "json"], (self.directory / path).read_bytes())
        self.assertEqual(report["regions"], json.loads(piped)["regions"])
        return {channel["name"]: channel for channel in report["regions"][0]["channels"]}

    def check(self, path, planes, options=()):
        """Minimum, maximum and mean of each plane, and its samples at the photosites of a mosaic."""
        found = self.read(path, options)
        self.assertEqual(list(found), list(planes))
        for name, samples in planes.items():
            wanted = samples.astype(np.float64)
            self.assertEqual(found[name]["min"], wanted.min(), name)
            self.assertEqual(found[name]["max"], wanted.max(), name)
            self.assertAlmostEqual(found[name]["mean"], wanted.mean(), delta=1e-9 * max(1.0, np.abs(wanted).max()))
        if set("RGB") <= set(planes):
            three = {name: planes[name].astype(np.float32) for name in "RGB"}
            for stdin in (b"", (self.directory / path).read_bytes()):
                words = [] if stdin else [path]
                cfa = self.frame(["mosaic", *words, "--pattern", "grbg", *options], stdin=stdin)
                self.same_planes(cfa, {"Y": mosaic(three, "grbg")})

    def check_plane(self, path, plane, options=(), pattern="rggb"):
        """All samples of a plane: at the sites of one class a demosaicked plane has those of the file."""
        self.check(path, {"Y": plane}, options)
        words = [*BI, "--black", "0", "--pattern", pattern]
        for stdin in (b"", (self.directory / path).read_bytes()):
            three = self.frame([*words, *([] if stdin else [path]), *options], stdin=stdin)
            self.same_planes({"Y": mosaic(three, pattern)}, {"Y": plane.astype(np.float32)})

    def refused(self, command, *mentions, status=BAD_DATA):
        done = self.attempt(command)
        text = done.stderr.decode()
        self.assertEqual((done.returncode, len(text.splitlines())), (status, 1), text)
        for mention in mentions:
            self.assertIn(mention, text)
        return text

    def told(self, path, options=()):
        """What a program says with -v."""
        done = self.attempt(["measure", path, "-v", *options])
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stderr.decode()


class Tiff(Others):
    """Planes behind filter arrays whose own tags say so."""

    def write(self, name, codes, filters=b"\1\0\2\1", size=(2, 2), tags=(), **options):
        array = [(33421, "H", 2, size, True), (33422, "B", len(filters), filters, True)]
        tifffile.imwrite(self.directory / name, codes, extratags=[*array, *tags], metadata=None, **options)

    def test_the_pattern_counts_and_black_is_asked_for(self):
        codes = self.codes()
        for photometric in ("cfa", "minisblack"):
            for compression in (None, "zlib"):
                self.write("cfa.tif", codes, photometric=photometric, compression=compression)
                self.check_plane("cfa.tif", codes, pattern="grbg")
                self.refused([*BI, "cfa.tif", "--pattern", "rggb"], "grbg by its metadata", status=BAD_USAGE)
                plain = self.frame([*BI, "cfa.tif", "--black", "0", "--pattern", "grbg"])
                self.same_planes(self.frame([*BI, "cfa.tif", "--black", "0"]), plain)
                self.refused([*BI, "cfa.tif"], "`black_level_adu`", "--black")
                self.assertIn("a CFA plane of ADU", self.told("cfa.tif"))

    def test_levels_and_exposure(self):
        codes = self.codes()
        levels = [(50714, "H", 1, 128, True), (50717, "H", 1, 4095, True)]
        capture = [(33434, "2I", 1, (1, 60), True), (33437, "2I", 1, (28, 10), True)]
        self.write("cfa.tif", codes, tags=[*levels, *capture], photometric="cfa")
        self.run_program([*BI, "cfa.tif", "-o", "rgb.exr"])
        wanted = self.frame([*BI, "cfa.tif", "--black", "128"])
        self.same_planes(self.planes((self.directory / "rgb.exr").read_bytes()), wanted)
        text = (self.directory / "rgb.exr.yaml").read_text()
        for line in ("black_level_adu: 0.0", "white_level_adu: 3967.0", "exposure_s: 0.016666", "f_number: 2.8"):
            self.assertIn(line, text)

    def test_exif(self):
        tags = TiffImagePlugin.ImageFileDirectory_v2()
        tags[34665] = {33434: TiffImagePlugin.IFDRational(1, 8), 33437: TiffImagePlugin.IFDRational(4, 1)}
        Image.fromarray(self.codes()).save(self.directory / "exif.tif", tiffinfo=tags)
        self.run_program([*BI, "exif.tif", "--black", "0", "--pattern", "rggb", "-o", "rgb.exr"])
        text = (self.directory / "rgb.exr.yaml").read_text()
        self.assertIn("exposure_s: 0.125", text)
        self.assertIn("f_number: 4.0", text)

    def test_other_arrays(self):
        codes = self.codes()
        x_trans = bytes("RGBCMYW".index(letter) for letter in "GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG")
        self.write("x.tif", codes, x_trans, (6, 6))
        self.refused([*BI, "x.tif", "--black", "0"], "an X-Trans filter array")
        self.write("unknown.tif", codes, b"\0\1\1\x09")
        self.assertIn("its color filter array is passed over", self.told("unknown.tif"))
        self.refused([*BI, "unknown.tif", "--black", "0"], "`cfa`", "--cfa")


class Png(Others):
    """Pictures of 8 and 16 bits."""

    def test_pillow(self):
        bytes_of = lambda channels: self.chance.integers(0, 256, (23, 37, channels)).astype(np.uint8)
        for mode, names in (("LA", "YA"), ("RGB", "RGB"), ("RGBA", "RGBA")):
            samples = bytes_of(len(names))
            Image.fromarray(samples, mode).save(self.directory / "in.png")
            self.check("in.png", {name: samples[:, :, at] for at, name in enumerate(names)})
        gray = bytes_of(1)[:, :, 0]
        Image.fromarray(gray).save(self.directory / "in.png")
        self.check_plane("in.png", gray)
        codes = self.codes(most=65536)
        Image.fromarray(codes).save(self.directory / "in.png")
        self.check_plane("in.png", codes)
        self.refused([*BI, "in.png", "--pattern", "rggb"], "`black_level_adu`")

    def test_openimageio(self):
        for names in ("Y", "RGB", "RGBA"):
            planes = {name: self.codes(most=65536) for name in names}
            # Colors that are not premultiplied are stored as they are.
            write_planes(self.path("in.png"), planes, "u16", oiio__UnassociatedAlpha=1)
            self.check("in.png", planes)

    def test_what_is_said_of_encoded_samples(self):
        info = PngImagePlugin.PngInfo()
        info.add(b"sRGB", b"\0")
        Image.fromarray(self.codes()).save(self.directory / "in.png", pnginfo=info)
        self.assertIn("its samples are encoded by sRGB; they are taken as stored", self.told("in.png"))

    def test_metadata_of_ours(self):
        info = PngImagePlugin.PngInfo()
        info.add_itxt("Description", "schema: cyanometer/1\nquantity: adu\ncfa: gbrg\nblack_level_adu: 64.0\n")
        codes = self.codes()
        Image.fromarray(codes).save(self.directory / "in.png", pnginfo=info)
        wanted = self.frame([*BI, "in.png", "--pattern", "gbrg", "--black", "64"])
        self.same_planes(self.frame([*BI, "in.png"]), wanted)

    def test_what_is_not_read_is_converted_as_advised(self):
        gray = (self.codes(most=256)).astype(np.uint8)
        Image.fromarray(gray).convert("P").save(self.directory / "palette.png")
        Image.fromarray(gray).convert("1").save(self.directory / "bits.png")
        for name, what in (("palette.png", "a palette"), ("bits.png", "have 1 bits")):
            self.refused(["measure", name], what, "oiiotool in.png -o out.tif")
            oiiotool(self.directory / name, "-o", self.directory / "out.tif")
            self.run_program(["measure", "out.tif"])


class Fits(Others):
    """Images by astropy."""

    def write(self, name, samples, parts=(), **cards):
        primary = fits.PrimaryHDU(samples)
        for key, value in cards.items():
            primary.header[key.replace("_", "-")] = value
        fits.HDUList([primary, *parts]).writeto(self.directory / name, overwrite=True)

    def test_samples(self):
        integers = self.chance.integers(-1000, 1000, (23, 37))
        floats = self.chance.uniform(-100, 1e5, (23, 37)).astype(np.float32)
        for samples in (
            *(integers.astype(kind) for kind in (np.int16, np.int32, np.int64)),
            *(np.abs(integers).astype(kind) for kind in (np.uint16, np.uint32, np.uint64)),
            (integers % 256).astype(np.uint8),
            (integers % 256 - 128).astype(np.int8),
            floats,
            floats.astype(np.float64),
        ):
            for order in ("TOP-DOWN", "BOTTOM-UP"):
                self.write("in.fits", samples, ROWORDER=order)
                self.check_plane("in.fits", samples if order == "TOP-DOWN" else samples[::-1])

    def test_planes(self):
        samples = self.codes((3, 23, 37), 65536)
        for order in ("TOP-DOWN", "BOTTOM-UP"):
            self.write("in.fits", samples, ROWORDER=order)
            planes = samples if order == "TOP-DOWN" else samples[:, ::-1]
            self.check("in.fits", dict(zip("RGB", planes)))

    def test_scaled_and_undefined(self):
        stored = self.chance.integers(-1000, 1000, (23, 37)).astype(np.int16)
        stored[3, 4] = -999
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self.write("in.fits", stored, BSCALE=0.5, BZERO=10.0, BLANK=-999)
            wanted = fits.getdata(self.directory / "in.fits")
        self.assertTrue(np.isnan(wanted[3, 4]))
        found = self.read("in.fits")["Y"]
        self.assertEqual((found["min"], found["max"]), (np.nanmin(wanted), np.nanmax(wanted)))
        self.assertIn("NaN", self.told("in.fits"))

    def test_filter_array_from_the_top_of_the_picture(self):
        codes = self.codes((24, 38))
        for pattern, x, y, wanted in (("RGGB", 0, 0, "rggb"), ("RGGB", 1, 0, "grbg"), ("GRBG", 0, 1, "bggr")):
            for order in ("TOP-DOWN", "BOTTOM-UP"):
                self.write("in.fits", codes, BAYERPAT=pattern, XBAYROFF=x, YBAYROFF=y, ROWORDER=order)
                top_down = codes if order == "TOP-DOWN" else codes[::-1]
                Image.fromarray(np.ascontiguousarray(top_down)).save(self.directory / "plain.png")
                expected = self.frame([*BI, "plain.png", "--black", "64", "--pattern", wanted])
                self.same_planes(self.frame([*BI, "in.fits", "--black", "64"]), expected)
                self.refused([*BI, "in.fits"], "`black_level_adu`")

    def test_exposure(self):
        self.write("in.fits", self.codes(), BAYERPAT="RGGB", EXPTIME=2.5, FOCALLEN=400.0, APTDIA=100.0, CCD_TEMP=-10.0)
        self.run_program([*BI, "in.fits", "--black", "0", "-o", "rgb.exr"])
        text = (self.directory / "rgb.exr.yaml").read_text()
        self.assertIn("exposure_s: 2.5", text)
        self.assertIn("f_number: 4.0", text)
        self.assertIn("sensor_temperature_k: 263.15", text)

    def test_parts(self):
        codes, floats = self.codes(), self.codes((8, 9)).astype(np.float32)
        table = fits.BinTableHDU.from_columns([fits.Column("a", "10A", array=["x", "yy"])])
        self.write("in.fits", None, [table, fits.ImageHDU(codes), fits.ImageHDU(floats)])
        self.check_plane("in.fits", codes, ["--part", "2"])
        self.check_plane("in.fits", floats, ["--part", "3"])
        self.refused(["measure", "in.fits"], "its part 0 holds no image, but part 2 does; give --part")
        self.refused(["measure", "in.fits", "--part", "1"], "a BINTABLE, not an image")
        self.refused(["measure", "in.fits", "--part", "7"], "there is no part 7", status=BAD_USAGE)

    def test_compressed_tiles_are_refused_by_name(self):
        self.write("in.fits", None, [fits.CompImageHDU(self.codes())])
        for options in ([], ["--part", "1"]):
            self.refused(["measure", "in.fits", *options], "compressed tiles", "funpack")

    def test_long_headers(self):
        codes = self.codes()
        self.write("in.fits", codes, **{f"KEY{number}": "it''s" for number in range(500)}, ROWORDER="TOP-DOWN")
        self.check_plane("in.fits", codes)

    def test_damage(self):
        self.write("in.fits", self.codes(), ROWORDER="TOP-DOWN", BAYERPAT="RGGB")
        data = (self.directory / "in.fits").read_bytes()
        for length in (9, 80, 2879, 2880, 3000):
            (self.directory / "cut.fits").write_bytes(data[:length])
            self.refused(["measure", "cut.fits"], "cut.fits", "cut short")


class Bare(Others):
    """Samples without a header."""

    def test_types(self):
        codes = self.codes(most=65536)
        for name, kind in (("u8", "u1"), ("u16le", "<u2"), ("u16be", ">u2"), ("f32le", "<f4")):
            samples = codes.astype(np.uint8 if kind == "u1" else codes.dtype).astype(kind)
            for offset in (0, 100):
                (self.directory / "in.raw").write_bytes(bytes(offset) + samples.tobytes())
                where = f":{offset}" if offset else ""
                self.check_plane("in.raw", samples, ["--raw", f"37x23:{name}{where}"])
        self.refused(["measure", "in.raw", "--raw", "37x22:f32le"], "it has 3504 bytes, but 37x22:f32le takes 3256")

    def test_dark_frames(self):
        light, dark = self.codes(), self.codes(most=100)
        light.tofile(self.directory / "light.raw")
        dark.tofile(self.directory / "dark.raw")
        words = ["correct-frame", "light.raw", "--raw", "37x23:u16le", "--dark", "dark.raw"]
        difference = light.astype(np.float32) - dark
        self.same_planes(self.frame(words), {"Y": difference})
        self.same_planes(self.frame([*words, "--crop", "5,3,8,6"]), {"Y": difference[3:9, 5:13]})

    def test_a_sidecar_counts(self):
        codes = self.codes()
        codes.astype("<u2").tofile(self.directory / "in.raw")
        (self.directory / "in.raw.yaml").write_text(
            "schema: cyanometer/1\nquantity: adu\ncfa: rggb\nblack_level_adu: 64\n"
        )
        wanted = self.frame([*BI, "in.raw", "--raw", "37x23:u16le", "--pattern", "rggb", "--black", "64"])
        self.same_planes(self.frame([*BI, "in.raw", "--raw", "37x23:u16le"]), wanted)


class Described(Others):
    """Frames that the command line describes."""

    CROP = ["--crop", "5,3,8,6"]

    def cut(self, planes):
        return {name: samples[3:9, 5:13] for name, samples in planes.items()}

    def test_a_crop_keeps_class_and_noise(self):
        electrons = self.run_program(["render-radiance", "--electrons", "1000,2000,3000", "--size", "21x14"])
        (self.directory / "electrons.exr").write_bytes(electrons)
        noise = ["add-noise", "--seed", "5"]
        whole = self.planes(self.run_program(noise, electrons))
        for stdin, words in ((electrons, []), (b"", ["electrons.exr"])):
            cropped = self.run_program([*noise, *words, *self.CROP], stdin)
            self.same_planes(self.planes(cropped), self.cut(whole))
            chain = (["digitize"], ["mosaic", "--pattern", "grbg"])
            later = self.run_pipe(noise, *chain, stdin=electrons)
            self.same_planes(self.frame(*chain, stdin=cropped), self.cut(self.planes(later)))
        # What is cropped after demosaicking, and what before, are the same where no edge is near.
        plane = self.run_pipe(noise, ["digitize"], ["mosaic"], stdin=electrons)
        black = ["--method", "bi", "--black", "0"]
        before = self.frame(["demosaic", *black, *self.CROP], stdin=plane)
        after = self.cut(self.frame(["demosaic", *black], stdin=plane))
        inside = lambda planes: {name: samples[1:-1, 1:-1] for name, samples in planes.items()}
        self.same_planes(inside(before), inside(after))

    def test_a_crop_of_every_format(self):
        codes = self.codes()
        Image.fromarray(codes).save(self.directory / "in.png")
        tifffile.imwrite(self.directory / "in.tif", codes, rowsperstrip=5)
        fits.PrimaryHDU(codes).writeto(self.directory / "in.fits")
        codes.astype("<u2").tofile(self.directory / "in.raw")
        part = codes[3:9, 5:13]
        for name, options in (("in.png", []), ("in.tif", []), ("in.fits", []), ("in.raw", ["--raw", "37x23:u16le"])):
            found = self.read(name, [*options, *self.CROP])["Y"]
            self.assertEqual((found["min"], found["max"]), (part.min(), part.max()), name)
            self.refused(["measure", name, *options, "--crop", "30,3,8,6"], "within the frame of 37x23", status=BAD_USAGE)

    def test_what_another_program_changed_is_told(self):
        chain = (["mosaic"], ["add-noise"], ["digitize"])
        light = self.run_program(["render-radiance", "--electrons", "9000,8000,7000", "--size", "24x16"])
        for end in ("tiff", "exr", "png"):
            own = f"own.{end}"
            words = ["digitize", "-o", own, *(["--viewable"] if end == "png" else [])]
            self.run_pipe(*chain[:2], words, stdin=light)
            (self.directory / f"{own}.yaml").unlink()
            other = f"other.{end}"
            for change, wanted in (
                ([], None),
                (["--cut", "15x9+1+0"], "15x9 pixels"),
                (["--rotate90"], "16x24 pixels"),
                (["--rotate180"], "changed them"),
                (["--flop"], "changed them"),
                (["--mulc", "1.5"], "changed them"),
                (["--powc", "0.4545"], "changed them"),
                (["--resize", "12x8"], "12x8 pixels"),
                (["-d", "uint8"], "changed them"),
            ):
                if end == "exr" and change[:1] == ["-d"]:
                    change = ["-d", "half", "--mulc", "1.01"]
                oiiotool(self.directory / own, *change, "-o", self.directory / other)
                for program in ("measure", "demosaic"):
                    done = self.attempt([program, other, *(["-o", "out.exr"] if program == "demosaic" else [])])
                    said = done.stderr.decode()
                    if wanted is None:
                        self.assertEqual(("changed" in said, done.returncode), (False, 0), (end, said))
                    else:
                        self.assertIn(wanted, said, (end, change))

    def test_images_of_several_pages(self):
        """tifffile leaves sixteen bytes that no tag names behind three pages; a second file behind the first is an error."""
        pages = np.stack([self.codes() + page for page in range(3)])
        for options in ({"metadata": None}, {"imagej": True}, {"bigtiff": True}):
            tifffile.imwrite(self.directory / "in.tif", pages, photometric="minisblack", **options)
            for page, codes in enumerate(pages):
                found = self.read("in.tif", ["--part", str(page)])["Y"]
                self.assertEqual((found["min"], found["max"]), (codes.min(), codes.max()), options)
            (self.directory / "two.tif").write_bytes((self.directory / "in.tif").read_bytes() * 2)
            self.refused(["measure", "two.tif"], "behind it comes a TIFF", "")

    def test_a_channel_is_a_plane(self):
        planes = {name: self.codes() for name in ("R", "G", "B", "A")}
        write_planes(self.path("in.tif"), planes, "u16")
        for name, samples in planes.items():
            self.check_plane("in.tif", samples, ["--channel", name])
        self.refused(["measure", "in.tif", "--channel", "Z"], "it has R, G, B, A", "--channel", status=BAD_USAGE)

    def test_levels_array_and_exposure(self):
        codes = np.minimum(self.codes(), 4000)
        Image.fromarray(codes).save(self.directory / "in.png")
        words = ["in.png", "--white", "4000", "--exposure", "0.5", "--f-number", "4"]
        self.run_program(["demosaic", *words, "--cfa", "gbrg", "--black", "64", "--method", "bi", "-o", "rgb.exr"])
        wanted = self.frame([*BI, "in.png", "--pattern", "gbrg", "--black", "64"])
        found = self.planes((self.directory / "rgb.exr").read_bytes())
        self.same_planes({name: found[name] for name in "RGB"}, wanted)
        text = (self.directory / "rgb.exr.yaml").read_text()
        for line in ("white_level_adu: 3936.0", "exposure_s: 0.5", "f_number: 4.0", "cfa: gbrg", "quantity: adu"):
            self.assertIn(line, text)
        done = self.attempt(["measure", *words, "--cfa", "gbrg", "--black", "64", "-v"])
        self.assertEqual(done.returncode, 0, done.stderr)
        saturated = int(np.count_nonzero(codes >= 4000))
        self.assertIn(f"{saturated} samples are saturated", done.stderr.decode())
        self.assertIn("a CFA plane of ADU", done.stderr.decode())
        self.refused(["measure", "in.png", "--f-number", "4"], "give --exposure", status=BAD_USAGE)
        # A time alone tells dark signals.
        self.run_program(["demosaic", *words[:-2], "--cfa", "gbrg", "--black", "64", "-o", "timed.exr", "-q"])
        self.assertIn("exposure_time_s: 0.5", (self.directory / "timed.exr.yaml").read_text())


if __name__ == "__main__":
    unittest.main()
