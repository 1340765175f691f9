"""Files beside OpenImageIO: what the programs write it reads, what it writes the programs read."""

import json
import re
import unittest

import numpy as np
import OpenImageIO as oiio

from programs import (
    ProgramCase,
    make_spec,
    mosaic,
    oiiotool,
    read_planes,
    read_spec,
    sample_data,
    write_parts,
    write_planes,
)

SIZE = "37x23"
# Writers give a band or a block at a time; this one is taller than any block of EXR and several strips of TIFF.
TALL = "19x150"

# Far enough below full well for no sample to be saturated.
RENDER = ["render-radiance", "--electrons", "1000,20000,35000", "--size"]
NOISE = ["add-noise", "--seed", "7"]


class Written(ProgramCase):
    """What the programs write."""

    def setUp(self):
        super().setUp()
        self.electrons = self.run_program([*RENDER, TALL])
        self.noisy = self.run_program(NOISE, self.electrons)
        self.noisy_planes = self.planes(self.noisy)

    def frames(self):
        """The input of each program that is tried, and the program."""
        codes = self.run_program(["digitize"], self.noisy)
        cfa = self.run_program(["mosaic"], codes)
        return {
            "add-noise": (self.electrons, NOISE),
            "digitize": (self.noisy, ["digitize"]),
            "mosaic": (codes, ["mosaic", "--pattern", "grbg"]),
            "demosaic": (cfa, ["demosaic", "--method", "eci"]),
        }

    def test_exr_is_single_precision_and_uncompressed_by_default(self):
        for name, (stdin, command) in self.frames().items():
            self.run_program([*command, "-o", f"{name}.exr"], stdin)
            spec = read_spec(self.directory / f"{name}.exr")
            self.assertEqual(str(spec.format), "float", name)
            self.assertEqual(spec.get_string_attribute("compression"), "none", name)
            self.assertEqual(spec.tile_width, 0, name)
            names = ("Y",) if name == "mosaic" else ("R", "G", "B")
            self.assertEqual(tuple(spec.channelnames), names)

    def test_exr_compressions_and_sample_types(self):
        for name, (stdin, command) in self.frames().items():
            plain = self.frame(command, stdin=stdin)
            for compression in ("none", "zip", "zips", "rle", "piz"):
                for sample_type in ("f32", "f16"):
                    with self.subTest(program=name, compression=compression, sample_type=sample_type):
                        self.run_program(
                            [
                                *(*command, "-o", "out.exr", "--compression", compression),
                                *("--sample-type", sample_type),
                            ],
                            stdin,
                        )
                        spec = read_spec(self.directory / "out.exr")
                        self.assertEqual(spec.get_string_attribute("compression"), compression)
                        self.assertEqual(str(spec.format), {"f32": "float", "f16": "half"}[sample_type])
                        expected = plain
                        if sample_type == "f16":
                            expected = {k: v.astype(np.float16).astype(np.float32) for k, v in plain.items()}
                        self.same_planes(read_planes(self.directory / "out.exr"), expected)

    def test_exr_options_on_standard_output(self):
        for compression in ("zip", "zips", "rle", "piz"):
            data = self.run_program([*NOISE, "--compression", compression], self.electrons)
            self.same_planes(self.planes(data), self.noisy_planes)

    def test_tiff_default_sample_types(self):
        for name, (stdin, command) in self.frames().items():
            with self.subTest(program=name):
                plain = self.frame(command, stdin=stdin)
                self.run_program([*command, "-o", "out.tif"], stdin)
                spec = read_spec(self.directory / "out.tif")
                wanted = "uint16" if name in ("digitize", "mosaic") else "float"
                self.assertEqual(str(spec.format), wanted)
                self.assertEqual(spec.nchannels, len(plain))
                self.same_planes(read_planes(self.directory / "out.tif"), plain)

    def test_tiff_compressions_and_sample_types(self):
        # OpenImageIO calls deflate zip.
        names = {"none": "none", "lzw": "lzw", "deflate": "zip"}
        codes = self.run_program(["digitize"], self.noisy)
        cases = [
            (["digitize"], self.noisy, "u16"),
            (["digitize"], self.noisy, "f32"),
            (["mosaic"], codes, "u16"),
            (["mosaic"], codes, "f32"),
            (NOISE, self.electrons, "f32"),
            (["demosaic"], self.run_program(["mosaic"], codes), "f32"),
        ]
        for command, stdin, sample_type in cases:
            plain = self.frame(command, stdin=stdin)
            for compression, theirs in names.items():
                with self.subTest(program=command[0], compression=compression, sample_type=sample_type):
                    options = ["--format", "tiff", "--compression", compression, "--sample-type", sample_type]
                    self.run_program([*command, *options, "-o", "out.tiff"], stdin)
                    spec = read_spec(self.directory / "out.tiff")
                    self.assertEqual(spec.get_string_attribute("compression"), theirs)
                    self.assertEqual(str(spec.format), {"u16": "uint16", "f32": "float"}[sample_type])
                    self.same_planes(read_planes(self.directory / "out.tiff"), plain)

    def test_png_has_the_samples_of_tiff(self):
        plane = self.run_program(["mosaic"], self.noisy)
        rgb = self.run_program(["demosaic"], self.run_program(["digitize"], plane))
        cases = {
            "picture": ("RGB", rgb, ["to-xyz", "--white-luminance", "900", "--space", "srgb"]),
            "three": ("RGB", self.noisy, ["digitize"]),
            "plane": ("Y", plane, ["digitize"]),
            "crop": ("Y", plane, ["digitize", "--crop", "3,5,11,60"]),
            "viewable": ("Y", plane, ["digitize", "--viewable"]),
        }
        for name, (channels, stdin, command) in cases.items():
            files = [f"{name}.{suffix}" for suffix in ("png", "tiff")]
            for file in files:
                self.run_program([*command, "-o", file], stdin)
            spec = read_spec(self.directory / files[0])
            self.assertEqual((str(spec.format), "".join(spec.channelnames)), ("uint16", channels), name)
            self.same_planes(*(read_planes(self.directory / file) for file in files))
            # Programs of ours read the same of both, place and metadata included, with the sidecar and without.
            for _ in range(2):
                reports = [self.run_program(["measure", file, "--output-format", "json"]) for file in files]
                self.assertEqual(*(json.loads(report)["regions"] for report in reports), name)
                frames = [self.run_program(["measure", file, "-v"]) for file in files]
                self.assertEqual(*frames, name)
                for file in files:
                    (self.directory / f"{file}.yaml").unlink(missing_ok=True)
        code_points = read_spec(self.directory / "picture.png").getattribute("CICP")
        self.assertEqual(tuple(code_points), (1, 13, 0, 1))

    def test_compressed_is_smaller(self):
        # Zeros: the run lengths of EXR find nothing in other flat frames of single precision.
        flat = self.run_program(["render-radiance", "--electrons", "0,0,0", "--size", "200x200"])
        for suffix, compressions in (("exr", ("zip", "zips", "rle", "piz")), ("tif", ("lzw", "deflate"))):
            for compression in compressions:
                self.run_program(["mosaic", "-o", f"a.{suffix}", "--compression", compression], flat)
                size = (self.directory / f"a.{suffix}").stat().st_size
                self.assertLess(size, 200 * 200 * 4 * 0.75, f"{suffix}, {compression}")

    def test_named_output_has_the_bytes_of_standard_output(self):
        for name, (stdin, command) in self.frames().items():
            for suffix, options in [
                ("exr", []),
                ("exr", ["--compression", "zip"]),
                ("exr", ["--sample-type", "f16"]),
                ("tif", ["--format", "tiff"]),
                ("tif", ["--format", "tiff", "--compression", "lzw"]),
            ]:
                with self.subTest(program=name, options=options):
                    piped = self.run_program([*command, *options], stdin)
                    self.run_program([*command, *options, "-o", f"out.{suffix}"], stdin)
                    self.assertEqual((self.directory / f"out.{suffix}").read_bytes(), piped)
                    self.assertEqual(self.run_program([*command, *options, "-o", "-"], stdin), piped)

    def test_metadata_is_embedded_and_beside_the_file(self):
        for name, (stdin, command) in self.frames().items():
            self.run_program([*command, "-o", f"{name}.exr"], stdin)
            self.run_program([*command, "-o", f"{name}.tif"], stdin)
            embedded = [
                read_spec(self.directory / f"{name}.exr").get_string_attribute("cyanometer"),
                read_spec(self.directory / f"{name}.tif").get_string_attribute("ImageDescription"),
            ]
            beside = [(self.directory / f"{name}.{suffix}.yaml").read_text() for suffix in ("exr", "tif")]
            for text in embedded + beside:
                self.assertTrue(text.startswith("schema: cyanometer/1\n"), f"{name}: {text[:60]!r}")
                self.assertIn("history", text)
                self.assertIn(name, text)
                self.assertNotIn(str(self.directory), text, "a path of this machine")

    def test_native_attributes(self):
        self.run_program(
            [*RENDER, SIZE, "--exposure", "0.25", "--f-number", "5.6", "-o", "electrons.exr"]
        )
        spec = read_spec(self.directory / "electrons.exr")
        # OpenImageIO gives expTime and aperture its own names.
        self.assertAlmostEqual(spec.get_float_attribute("ExposureTime", -1.0), 0.25, places=6)
        self.assertAlmostEqual(spec.get_float_attribute("FNumber", -1.0), 5.6, places=6)
        self.run_program([*NOISE, "electrons.exr", "-o", "noisy.exr"])
        spec = read_spec(self.directory / "noisy.exr")
        self.assertAlmostEqual(spec.get_float_attribute("ExposureTime", -1.0), 0.25, places=6)
        self.run_program([*NOISE, "electrons.exr", "-o", "noisy.tif"])
        software = read_spec(self.directory / "noisy.tif").get_string_attribute("Software")
        self.assertRegex(software, r"cyanometer|add-noise")

    def test_header_in_raw_bytes(self):
        # OpenImageIO renames attributes, so look for the names and types that the file itself holds.
        header = self.noisy[: 1 << 16]
        for name, kind in [(b"cyanometer", b"string"), (b"expTime", b"float"), (b"aperture", b"float")]:
            self.assertIn(name + b"\0" + kind + b"\0", header)

    def test_xyz_has_its_chromaticities(self):
        library = sample_data("skies/sky912.exr")
        self.run_program(["fit-matrix", library, "--sensor", "kaf-5101ce", "-o", "matrix.yaml"])
        rgb = self.run_pipe(
            [*RENDER, SIZE], NOISE, ["digitize"], ["mosaic"], ["demosaic", "--method", "bi"]
        )
        self.run_program(["to-xyz", "--matrix", "matrix.yaml", "-o", "xyz.exr"], rgb)
        spec = read_spec(self.directory / "xyz.exr")
        self.assertEqual(tuple(spec.channelnames), ("R", "G", "B"))
        values = spec.getattribute("chromaticities")
        self.assertIsNotNone(values, "no chromaticities")
        np.testing.assert_allclose(values, (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3), atol=1e-6)

    def test_layers_in_a_part_of_their_own(self):
        rgb = self.run_pipe([*RENDER, SIZE], NOISE, ["digitize"], ["mosaic"])
        demosaic = ["demosaic", "--method", "bi", "--sigma"]
        self.run_program([*demosaic, "-o", "beside.exr"], rgb)
        beside = read_planes(self.directory / "beside.exr")
        colors = ("R", "G", "B")
        self.assertIn("sigma.G", beside)
        for compression in ("none", "zip", "piz"):
            self.run_program(
                [*demosaic, "--separate-layers", "--compression", compression, "-o", "apart.exr"], rgb
            )
            apart = self.directory / "apart.exr"
            first, second = read_spec(apart, 0), read_spec(apart, 1)
            self.assertEqual(first.get_string_attribute("name"), "image")
            self.assertEqual(second.get_string_attribute("name"), "layers")
            self.assertEqual(second.get_string_attribute("colorInteropID"), "data")
            self.assertEqual(first.getattribute("chromaticities"), second.getattribute("chromaticities"))
            self.same_planes(read_planes(apart, 0), {name: beside[name] for name in colors})
            self.same_planes(
                read_planes(apart, 1), {name: plane for name, plane in beside.items() if name not in colors}
            )
            # Our programs see no difference, through a pipe either.
            report = ["measure", "--output-format", "csv"]
            expected = self.run_program([*report, "beside.exr"]).replace(b"beside", b"apart")
            self.assertEqual(self.run_program([*report, "apart.exr"]), expected)
        refused = self.attempt([*demosaic, "--separate-layers"], rgb)
        self.assertEqual(refused.returncode, 2)
        self.assertIn(b"name the output", refused.stderr)

    def test_sensitivity_is_told(self):
        description = "schema: cyanometer/1\nquantity: adu\nunit: ADU\ncfa: rggb\nblack_level_adu: 100\nwhite_level_adu: 4095\n"
        (self.directory / "frame.yaml").write_text(description + "iso_speed: 400\n", encoding="utf-8")
        codes = np.arange(64, dtype=np.uint16).reshape(8, 8)
        write_planes(self.path("codes.tif"), {"Y": codes}, "u16")
        for name in ("frame.exr", "frame.tif"):
            self.run_program(["correct-frame", "codes.tif", "--metadata", "frame.yaml", "--black", "auto", "-o", name])
            spec = read_spec(self.directory / name)
            told = [spec.getattribute(key) for key in ("isoSpeed", "Exif:ISOSpeedRatings", "Exif:PhotographicSensitivity")]
            self.assertIn(400, [number for value in told if value is not None for number in np.ravel(value)], name)


class Read(ProgramCase):
    """What OpenImageIO writes."""

    def setUp(self):
        super().setUp()
        self.chance = np.random.default_rng(1)

    def color(self, sample_type, width=37, height=23, names="RGB"):
        """Random planes that the sample type holds exactly."""
        kinds = {
            "u8": lambda shape: self.chance.integers(0, 256, shape).astype(np.uint8),
            "u16": lambda shape: self.chance.integers(0, 65536, shape).astype(np.uint16),
            "u32": lambda shape: self.chance.integers(0, 1 << 24, shape).astype(np.uint32),
            "f16": lambda shape: self.chance.uniform(-100, 2000, shape).astype(np.float16),
            "f32": lambda shape: self.chance.uniform(-100, 40000, shape).astype(np.float32),
        }
        return {name: kinds[sample_type]((height, width)) for name in names}

    def check_samples(self, path, planes, what, origin=(0, 0), options=()):
        """The program keeps at each photosite exactly the sample of the file."""
        cfa = self.frame(["mosaic", path, "--pattern", "rggb", *options])
        self.assertEqual(sorted(cfa), ["Y"], what)
        expected = mosaic({k: v.astype(np.float32) for k, v in planes.items()}, "rggb", origin)
        different = np.count_nonzero(cfa["Y"] != expected)
        self.assertEqual(different, 0, f"{what}: {different} of {expected.size} samples differ")

    def check_statistics(self, path, planes, what, options=()):
        report = json.loads(self.run_program(["measure", path, "--output-format", "json", *options]))
        self.assertEqual(len(report["regions"]), 1, what)
        region = report["regions"][0]
        measured = {channel["name"]: channel for channel in region["channels"]}
        self.assertEqual(sorted(measured), sorted(planes), what)
        stack = np.stack([planes[name].astype(np.float64).ravel() for name in planes])
        self.assertEqual(region["count"], stack.shape[1], what)
        for name, samples in planes.items():
            samples = samples.astype(np.float64)
            channel = measured[name]
            scale = max(np.abs(samples).max(), 1e-30)
            self.assertEqual(channel["min"], samples.min(), f"{what}: {name}")
            self.assertEqual(channel["max"], samples.max(), f"{what}: {name}")
            self.assertLess(abs(channel["mean"] - samples.mean()) / scale, 1e-9, f"{what}: {name}")
            self.assertLess(abs(channel["std"] - samples.std(ddof=1)) / scale, 1e-9, f"{what}: {name}")
        order = [list(planes).index(channel["name"]) for channel in region["channels"]]
        covariance = np.cov(stack[order])
        np.testing.assert_allclose(
            np.array(region["covariance"]).reshape(covariance.shape), covariance,
            rtol=1e-8, atol=1e-8 * np.abs(covariance).max(), err_msg=what,
        )

    def test_exr_layouts(self):
        for sample_type in ("f32", "f16", "u32"):
            for compression in ("none", "rle", "zips", "zip", "piz"):
                for tile in (None, (16, 16), (64, 8)):
                    with self.subTest(sample_type=sample_type, compression=compression, tile=tile):
                        planes = self.color(sample_type)
                        write_planes(self.path("in.exr"), planes, sample_type, tile=tile, compression=compression)
                        self.check_samples("in.exr", planes, "EXR")

    def test_tall_exr_with_every_compression(self):
        for compression in ("none", "rle", "zips", "zip", "piz"):
            planes = self.color("f32", 11, 131)
            write_planes(self.path("in.exr"), planes, "f32", compression=compression)
            self.check_samples("in.exr", planes, compression)
            self.check_statistics("in.exr", planes, compression)

    def test_compressed_exr_through_a_pipe(self):
        planes = self.color("f32")
        for compression in ("none", "zip", "piz"):
            write_planes(self.path("in.exr"), planes, "f32", compression=compression)
            data = (self.directory / "in.exr").read_bytes()
            cfa = self.frame(["mosaic", "--pattern", "rggb"], stdin=data)
            np.testing.assert_array_equal(cfa["Y"], mosaic(planes, "rggb"))

    def test_exr_from_bottom_to_top(self):
        planes = self.color("f32")
        write_planes(self.path("in.exr"), planes, "f32", openexr__lineOrder="decreasingY")
        self.check_samples("in.exr", planes, "decreasing line order")
        done = self.attempt(["mosaic", "--pattern", "rggb"], (self.directory / "in.exr").read_bytes())
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"bottom to top", done.stderr)
        self.assertNotIn(b"damaged", done.stderr)

    def test_exr_compressions_that_lose(self):
        for compression in ("pxr24", "b44", "dwaa"):
            for sample_type in ("f32", "f16", "u32"):
                planes = self.color(sample_type)
                write_planes(self.path("in.exr"), planes, sample_type, compression=compression)
                # PXR24 keeps all bits of half and integer samples.
                if compression == "pxr24" and sample_type != "f32":
                    self.check_samples("in.exr", planes, f"{compression} {sample_type}")
                else:
                    done = self.attempt(["mosaic", "in.exr", "--pattern", "rggb"])
                    self.assertEqual(done.returncode, 1)
                    self.assertIn(compression.encode(), done.stderr)
                    self.assertIn(b"zip", done.stderr)

    def test_exr_compression_of_the_future(self):
        planes = self.color("f32")
        write_planes(self.path("in.exr"), planes, "f32", compression="none")
        data = (self.directory / "in.exr").read_bytes()
        kind = data.index(b"compression\0compression\0\1\0\0\0") + 28
        (self.directory / "in.exr").write_bytes(data[:kind] + b"\x63" + data[kind + 1 :])
        done = self.attempt(["mosaic", "in.exr", "--pattern", "rggb"])
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"compression is missing or of an unknown kind", done.stderr)

    def test_exr_statistics(self):
        layer = ("left.R", "left.G", "left.B")
        for names in ("Y", "RGB", "RGBA", "ab", "abc", layer, ("left.R", "depth.Z", "mask")):
            for sample_type in ("f32", "f16"):
                with self.subTest(names=names, sample_type=sample_type):
                    planes = self.color(sample_type, names=names)
                    write_planes(self.path("in.exr"), planes, sample_type)
                    self.check_statistics("in.exr", planes, f"channels {names}")

    def test_exr_layer_is_not_taken_in_the_order_of_the_file(self):
        # The file holds left.B, left.G, left.R: a program may refuse them, but may not take blue for red.
        planes = self.color("f32")
        write_planes(self.path("in.exr"), {f"left.{name}": planes[name] for name in "RGB"}, "f32")
        done = self.attempt(["mosaic", "in.exr", "--pattern", "rggb"])
        if done.returncode == 0:
            np.testing.assert_array_equal(self.planes(done.stdout)["Y"], mosaic(planes, "rggb"))
        else:
            self.assertEqual(done.returncode, 1, done.stderr)

    def test_exr_extra_channels(self):
        for names in (("R", "G", "B", "A"), ("A", "B", "G", "R", "Z"), ("R", "G", "B", "mask.m", "other.R")):
            planes = self.color("f32", names=names)
            write_planes(self.path("in.exr"), planes, "f32")
            self.check_samples("in.exr", planes, f"channels {names}")

    def test_exr_parts(self):
        first, second = self.color("f32"), self.color("f16", 20, 31)
        specs = [make_spec(first, "f32", oiio__subimagename="first"), make_spec(second, "f16", compression="zip")]
        specs[1].attribute("oiio:subimagename", "second")
        for spec in specs:  # parts share one display window
            spec.full_width, spec.full_height = 40, 40
        write_parts(self.path("parts.exr"), [(first, specs[0]), (second, specs[1])])
        self.check_samples("parts.exr", first, "default part")
        self.check_samples("parts.exr", first, "part 0", options=["--part", "0"])
        self.check_samples("parts.exr", second, "part 1", options=["--part", "1"])
        self.check_statistics("parts.exr", second, "part 1", ["--part", "1"])

    def test_exr_data_window_keeps_the_phase_of_the_array(self):
        for origin in [(0, 0), (1, 0), (0, 1), (5, 3), (-3, 4), (100, 201)]:
            for tile in (None, (16, 16)):
                planes = self.color("f32")
                spec = make_spec(planes, "f32", origin=origin, tile=tile)
                spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, 400, 300
                write_parts(self.path("in.exr"), [(planes, spec)])
                self.check_samples("in.exr", planes, f"data window at {origin}, tiles {tile}", origin)
                self.check_statistics("in.exr", planes, f"data window at {origin}")

    def test_tiff_layouts(self):
        for sample_type in ("u8", "u16", "f32"):
            for compression in ("none", "lzw", "zip", "packbits"):
                for tile in (None, (16, 16)):
                    for layout in ("contig", "separate"):
                        what = f"{sample_type} {compression} {tile} {layout}"
                        with self.subTest(what):
                            planes = self.color(sample_type)
                            write_planes(
                                self.path("in.tif"), planes, sample_type,
                                tile=tile, compression=compression, planarconfig=layout,
                            )
                            self.check_samples("in.tif", planes, what)

    def test_tiff_half(self):
        for tile in (None, (16, 16)):
            planes = self.color("f16")
            write_planes(self.path("in.tif"), planes, "f16", tile=tile, tiff__half=1, compression="none")
            self.assertEqual(str(read_spec(self.path("in.tif")).format), "half")
            self.check_samples("in.tif", planes, f"half, tiles {tile}")

    def test_tiff_strips_of_some_rows(self):
        for rows in (1, 5, 23):
            planes = self.color("u16")
            write_planes(
                self.path("in.tif"), planes, "u16", tiff__RowsPerStrip=rows, compression="lzw"
            )
            self.check_samples("in.tif", planes, f"strips of {rows} rows")

    def test_big_tiff(self):
        for sample_type in ("u16", "f32"):
            planes = self.color(sample_type)
            write_planes(self.path("in.tif"), planes, sample_type, tiff__bigtiff=1)
            self.assertEqual((self.directory / "in.tif").read_bytes()[2:4], b"\x2b\x00", "not a BigTIFF")
            self.check_samples("in.tif", planes, f"BigTIFF {sample_type}")

    def test_tiff_with_an_extra_channel(self):
        for sample_type in ("u8", "u16", "f32"):
            for layout in ("contig", "separate"):
                planes = self.color(sample_type, names="RGBA")
                write_planes(self.path("in.tif"), planes, sample_type, planarconfig=layout)
                self.check_samples("in.tif", planes, f"RGBA {sample_type} {layout}")

    def test_tiff_statistics(self):
        for sample_type in ("u8", "u16", "f32"):
            for names in ("Y", "RGB"):
                planes = self.color(sample_type, names=names)
                write_planes(self.path("in.tif"), planes, sample_type)
                self.check_statistics("in.tif", planes, f"{names} {sample_type}")

    def test_what_we_write_we_read(self):
        planes = self.color("f32")
        write_planes(self.path("in.exr"), planes, "f32")
        cases = [("exr", c) for c in ("none", "zip", "zips", "rle", "piz")]
        cases += [("tif", c) for c in ("none", "lzw", "deflate")]
        expected = self.frame(["mosaic", "in.exr", "--pattern", "bggr"])
        black = ["demosaic", "--method", "bi", "--black", "none"]
        wanted = self.frame(black, stdin=self.run_program(["mosaic", "in.exr", "--pattern", "bggr"]))
        for suffix, compression in cases:
            name = f"cfa.{suffix}"
            self.run_program(
                [
                    *("mosaic", "in.exr", "--pattern", "bggr", "--compression", compression),
                    *("--sample-type", "f32", "-o", name),
                ]
            )
            self.same_planes(read_planes(self.directory / name), expected)
            self.same_planes(self.frame([*black, name]), wanted)


class Tools(ProgramCase):
    """oiiotool and OpenImageIO's algorithms beside ours."""

    def test_stats_agree_with_measure(self):
        self.run_pipe([*RENDER, SIZE], [*NOISE, "-o", "noisy.exr"])
        self.run_program(["digitize", "noisy.exr", "-o", "codes.tif"])
        for name in ("noisy.exr", "codes.tif"):
            text = oiiotool("--stats", self.path(name))
            report = json.loads(self.run_program(["measure", name, "--output-format", "json"]))
            region = report["regions"][0]
            n = region["count"]
            lines = {
                kind: re.findall(r"-?[0-9.]+(?:e[-+]?\d+)?", line)
                for kind, line in re.findall(r"Stats (\w+):([^(\n]*)", text)
            }
            for index, channel in enumerate(region["channels"]):
                population = channel["std"] * ((n - 1) / n) ** 0.5
                for kind, ours in [
                    ("Min", channel["min"]),
                    ("Max", channel["max"]),
                    ("Avg", channel["mean"]),
                    ("StdDev", population),
                ]:
                    theirs = lines[kind][index]
                    # Six decimals are printed of floats, two of integers, from values in single precision.
                    decimals = len(theirs.partition(".")[2])
                    self.assertLess(
                        abs(float(theirs) - ours),
                        10**-decimals + 1e-6 * abs(ours),
                        f"{name} {channel['name']} {kind}: {theirs}, {ours}",
                    )

    def test_regions_of_measure(self):
        self.run_pipe([*RENDER, SIZE], [*NOISE, "-o", "noisy.exr"])
        planes = read_planes(self.directory / "noisy.exr")
        report = json.loads(
            self.run_program(
                ["measure", "noisy.exr", "--output-format", "json", "--region", "0,0,1,2", "--region", "5,3,20,11"]
            )
        )
        for region, (x, y, width, height) in zip(report["regions"], [(0, 0, 1, 2), (5, 3, 20, 11)], strict=True):
            self.assertEqual(region["count"], width * height)
            for channel in region["channels"]:
                part = planes[channel["name"]][y : y + height, x : x + width].astype(np.float64)
                np.testing.assert_allclose(channel["mean"], part.mean(), rtol=1e-10)
                np.testing.assert_allclose(channel["std"], part.std(ddof=1), rtol=1e-8)

    def test_noise_of_a_crop_is_the_crop_of_the_noise(self):
        self.run_program([*RENDER, SIZE, "-o", "whole.exr"])
        whole = self.frame([*NOISE, "whole.exr"])
        for width, height, x, y in [(20, 10, 5, 3), (1, 1, 36, 22), (37, 1, 0, 8), (16, 12, 2, 4)]:
            oiiotool(self.path("whole.exr"), "--crop", f"{width}x{height}+{x}+{y}", "-o", self.path("crop.exr"))
            spec = read_spec(self.directory / "crop.exr")
            self.assertEqual((spec.x, spec.y, spec.width, spec.height), (x, y, width, height))
            crop = self.frame([*NOISE, "crop.exr"])
            cut = {k: v[y : y + height, x : x + width] for k, v in whole.items()}
            self.same_planes(crop, cut)

            codes = self.frame([*NOISE, "whole.exr"], ["digitize"])
            cropped_codes = self.frame([*NOISE, "crop.exr"], ["digitize"])
            self.same_planes(cropped_codes, {k: v[y : y + height, x : x + width] for k, v in codes.items()})

            for pattern in ("rggb", "gbrg"):
                keep = ["mosaic", "--pattern", pattern]
                cfa = self.frame([*NOISE, "whole.exr"], keep)["Y"]
                kept = self.frame([*NOISE, "crop.exr"], keep)["Y"]
                np.testing.assert_array_equal(kept, cfa[y : y + height, x : x + width])

    def test_cropped_cfa_keeps_its_phase(self):
        # The red, green and blue of a flat scene come back from a crop only if the phase is known.
        self.run_pipe([*RENDER, SIZE], ["mosaic", "--pattern", "grbg", "-o", "cfa.exr"])
        for x, y in [(0, 0), (1, 0), (0, 1), (7, 5)]:
            oiiotool(self.path("cfa.exr"), "--crop", f"20x10+{x}+{y}", "-o", self.path("crop.exr"))
            planes = self.frame(["demosaic", "crop.exr", "--method", "bi", "--black", "none"])
            for name, level in zip("RGB", (1000, 20000, 35000)):
                np.testing.assert_allclose(planes[name], level, rtol=1e-6, err_msg=f"crop at {x},{y}")

    def test_linear_demosaic_agrees_with_bilinear(self):
        chance = np.random.default_rng(5)
        codes = chance.uniform(0, 1, (40, 60)).astype(np.float32)
        write_planes(self.path("cfa.exr"), {"Y": codes}, "f32")
        for pattern in ("rggb", "bggr", "grbg", "gbrg"):
            theirs = oiio.ImageBufAlgo.demosaic(
                oiio.ImageBuf(self.path("cfa.exr")), pattern="bayer", algorithm="linear", layout=pattern.upper()
            )
            self.assertFalse(theirs.has_error, theirs.geterror())
            theirs = theirs.get_pixels(oiio.FLOAT)
            ours = self.frame(
                ["demosaic", "cfa.exr", "--pattern", pattern, "--method", "bi", "--black", "none"]
            )
            for index, name in enumerate("RGB"):
                np.testing.assert_allclose(
                    ours[name][2:-2, 2:-2], theirs[2:-2, 2:-2, index], rtol=1e-5, atol=1e-6, err_msg=pattern
                )


class Reference(unittest.TestCase):
    """OpenImageIO's demosaicking beside the reference of test_demosaic.py, so that the last test means something."""

    def test_linear_is_bilinear_away_from_the_edges(self):
        from programs import class_masks
        from test_demosaic import bilinear

        codes = np.random.default_rng(6).uniform(0, 1, (20, 24)).astype(np.float32)
        source = oiio.ImageBuf(oiio.ImageSpec(24, 20, 1, oiio.FLOAT))
        source.set_pixels(oiio.ROI(0, 24, 0, 20), codes[:, :, None])
        for pattern in ("rggb", "bggr", "grbg", "gbrg"):
            theirs = oiio.ImageBufAlgo.demosaic(
                source, pattern="bayer", algorithm="linear", layout=pattern.upper()
            ).get_pixels(oiio.FLOAT)
            ours = bilinear(codes.astype(np.float64), class_masks(pattern, 20, 24))
            for index, name in enumerate("RGB"):
                np.testing.assert_allclose(ours[name][2:-2, 2:-2], theirs[2:-2, 2:-2, index], rtol=1e-5)
