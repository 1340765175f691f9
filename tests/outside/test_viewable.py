"""Frames for viewers: what other programs find in them."""

import numpy as np
import OpenImageIO as oiio
import tifffile
import yaml

from programs import SAMPLE_DATA, ProgramCase

# The digits that 16 bits behind the point leave of a colorant, and of its products with samples of at most 1.
PROFILE_DIGITS = 4 / 65536


def profile_of(path):
    """Colorants and lines of an ICC profile of parametric curves [ICC.1:2022, 10.18]: of type 1, which end at black, or of type 4, straight on
    both sides of 0."""
    with tifffile.TiffFile(path) as file:
        tag = file.pages[0].tags.get(34675)
        if tag is None:
            return None
        profile = bytes(tag.value)
    tags = {}
    for index in range(int.from_bytes(profile[128:132], "big")):
        entry = profile[132 + 12 * index : 144 + 12 * index]
        start, size = (int.from_bytes(entry[at : at + 4], "big") for at in (4, 8))
        tags[entry[:4]] = profile[start : start + size]
    fixed = lambda data: np.frombuffer(data, ">i4") / 65536
    colorants = np.stack([fixed(tags[name][8:20]) for name in (b"rXYZ", b"gXYZ", b"bXYZ")], axis=1)
    lines = []
    for name in (b"rTRC", b"gTRC", b"bTRC"):
        kind, values = tags[name][8:10], fixed(tags[name][12:])
        slope, offset = values[1], values[2]
        wanted = (b"\0\4", [1, slope, 0, slope, 0, 0, 0]) if offset == 0 else (b"\0\1", [1, slope, offset])
        assert (kind, list(values)) == wanted, (kind, values)
        lines.append([slope, offset])
    return colorants, np.array(lines)


class Viewable(ProgramCase):
    def setUp(self):
        super().setUp()
        sky = SAMPLE_DATA / "skies/sky912.exr"
        self.run_program(["fit-matrix", sky, "-o", "matrix.yaml", "-q"])
        self.run_program(["render-radiance", sky, "--patch", "4x4", "--expose-to", "0.7", "-o", "rates.exr", "-q"])

    def chain(self, end, *options):
        """Codes, sensor RGB and XYZ in files of a kind."""
        names = [f"{name}.{end}" for name in ("codes", "rgb", "xyz")]
        self.run_program(["digitize", "rates.exr", *options, "-o", names[0], "-q"])
        self.run_program(["mosaic", names[0], "-o", "plane.exr", "-q"])
        self.run_program(["demosaic", "plane.exr", *options, "-o", names[1], "-q"])
        white = ["--matrix", "matrix.yaml", "--white-luminance", "60000"]
        self.run_program(["to-xyz", names[1], *white, *options, "-o", names[2], "-q"])
        return names

    def read(self, name):
        return np.asarray(oiio.ImageBuf(self.path(name)).get_pixels(oiio.FLOAT))[..., :3].astype(float)

    def sidecar(self, name):
        return yaml.safe_load((self.directory / f"{name}.yaml").read_text(encoding="utf-8"))

    def scale(self, name):
        return self.sidecar(name)["sample_scale"]

    def test_others_read_the_samples_times_the_scale(self):
        for end in ("exr", "tiff"):
            read = (lambda name: tifffile.imread(self.path(name))) if end == "tiff" else self.read
            plain = [read(name).astype(float) for name in self.chain(end)]
            for name, expected in zip(self.chain(end, "--viewable"), plain):
                with self.subTest(name):
                    stored = read(name)
                    scale = self.scale(name)
                    self.assertEqual(np.log2(scale) % 1, 0)
                    np.testing.assert_array_equal(stored / scale, expected)
                    full = 65535 if stored.dtype == np.uint16 else 1
                    self.assertGreater(stored.max(), 0.25 * full)
                    self.assertLessEqual(stored.max(), full)

    def test_the_profile_tells_the_colors(self):
        """By the profile samples have the XYZ that to-xyz gives, white adapted to D50 by Bradford, Y = 1 there."""
        bradford = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
        d65 = np.array([0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290])
        d50 = np.array([0.9642, 1, 0.8249])
        adapt = np.linalg.inv(bradford) @ np.diag(bradford @ d50 / (bradford @ d65)) @ bradford
        codes, rgb, xyz = self.chain("tiff", "--viewable")
        truth = tifffile.imread(self.path(xyz)) / self.scale(xyz)
        stored = tifffile.imread(self.path(xyz)).astype(float)
        colorants, lines = profile_of(self.path(xyz))
        told = (stored * lines[:, 0] + lines[:, 1]) @ colorants.T
        np.testing.assert_allclose(told, truth @ adapt.T / 60000, atol=PROFILE_DIGITS * 3)
        # Those of the camera are by its own matrix, of which that of `fit-matrix` differs; white is that of the converter.
        sensor = self.sidecar(rgb)
        matrix = np.array(sensor["sensor"]["xyz_from_camera"])
        colorants, lines = profile_of(self.path(codes))
        samples = tifffile.imread(self.path(codes)).astype(float) / 65535
        black, white = sensor["demosaic"]["black"], 4095
        shares = (tifffile.imread(self.path(codes)) / self.scale(codes) - black) / (white - black)
        np.testing.assert_allclose(samples * lines[:, 0] + lines[:, 1], shares, atol=PROFILE_DIGITS)
        np.testing.assert_allclose(colorants, adapt @ matrix / matrix[1].sum(), atol=PROFILE_DIGITS)

    def test_attributes(self):
        for name in self.chain("exr", "--viewable"):
            spec = oiio.ImageInput.open(self.path(name)).spec()
            self.assertIsNotNone(spec.getattribute("chromaticities"), name)
        neutral = spec.getattribute("adoptedNeutral")
        np.testing.assert_allclose(neutral, [0.3127, 0.3290], atol=1e-6)
        self.assertAlmostEqual(spec.getattribute("whiteLuminance") * self.scale("xyz.exr"), 1)
        self.assertEqual(spec.getattribute("colorInteropID"), "lin_ciexyzd65_scene")
        self.chain("tiff")
        with tifffile.TiffFile(self.path("codes.tiff")) as file:
            exif = file.pages[0].tags[34665].value
        self.assertEqual(exif["FNumber"], (8, 1))

    def test_a_scale_that_is_no_power_of_two_is_refused(self):
        tifffile.imwrite(self.path("theirs.tiff"), np.full((4, 4), 100, np.uint16))
        with open(self.path("theirs.tiff.yaml"), "w", encoding="utf-8") as file:
            file.write("schema: cyanometer/1\nquantity: adu\nsample_scale: 0.3\n")
        done = self.attempt(["measure", "theirs.tiff"])
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"its `sample_scale`, 0.3, is no power of two", done.stderr)
