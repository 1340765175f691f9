"""Viewers without their windows: each opens a frame as a user's click does, and writes the picture that it shows."""

import dataclasses
import shutil
import typing

from conformance.converters import said


# The profile of sRGB, in the directory of the frames.
PROFILE = "srgb.icc"


@dataclasses.dataclass
class Viewer:
    """A program: how it is called, which formats it reads, what asks for its version, and what else it is run by."""

    name: str
    program: str
    command: typing.Callable
    asks: list
    pattern: str
    formats: tuple = ("exr", "tiff")
    harness: tuple = ()

    def version(self):
        return said([self.program, *self.asks], self.pattern)

    def lacks(self):
        """What it is run by and is missing."""
        return [program for program in self.harness if shutil.which(program) is None]


def first_of(*programs):
    return next((program for program in programs if shutil.which(program)), programs[-1])


IMAGEJ = "/usr/share/java/ij.jar"
MAGICK = first_of("magick", "convert-im6.q16", "convert")

VIEWERS = [
    Viewer("ImageMagick", MAGICK, lambda frame, out: [MAGICK, f"{frame}[0]", "-colorspace", "sRGB", "-depth", 8, out], ["-version"],
           r"ImageMagick ([\d.-]+)"),
    Viewer("oiiotool", "oiiotool", lambda frame, out: ["oiiotool", frame, "-d", "uint8", "-o", out],
           ["--version"], r"([\d.]+)"),
    Viewer("vips", "vips", lambda frame, out: ["vips", "thumbnail", frame, out, 100000, "--size", "down", "--export-profile", "srgb"],
           ["--version"], r"vips-([\d.]+)"),
    Viewer("darktable", "darktable-cli",
           lambda frame, out: ["darktable-cli", frame, out, "--core", "--configdir", out.parent / "darktable", "--library",
                               ":memory:"], ["--version"], r"darktable(?:-cli)? ([\d.]+)"),
    Viewer("RawTherapee", "rawtherapee-cli", lambda frame, out: ["rawtherapee-cli", "-Y", "-n", "-o", out, "-c", frame],
           ["-h"], r"version ([\d.]+)", ("tiff",)),
    Viewer("GIMP", "gimp-console-2.10",
           lambda frame, out: ["gimp-console-2.10", "-i", "-d", "-f", "-b", gimp_script(frame, out), "-b", "(gimp-quit 0)"],
           ["--version"], r"version ([\d.]+)"),
    # Its version stands in the name of what is behind the link; a complaint waits in a window of its own.
    Viewer("ImageJ", "readlink", lambda frame, out: ["timeout", 20, "xvfb-run", "-a", "java", "-cp", IMAGEJ, "ij.ImageJ", "-batch",
                                                     imagej_macro(out), f"{frame}|{out}"],
           ["-f", IMAGEJ], r"ij-([\d.]+[a-z]?)\.jar", ("tiff",), ("timeout", "xvfb-run", "java")),
]


def imagej_macro(out):
    """The file of a macro that writes what the window shows: three planes together, from their least sample to their largest."""
    macro = out.parent / "show.ijm"
    macro.write_text(
        'words = split(getArgument(), "|"); open(words[0]); if (is("composite")) Stack.setDisplayMode("composite");'
        'run("RGB Color"); saveAs("PNG", words[1]);\n', encoding="utf-8")
    return macro


def gimp_script(frame, out):
    """What the window shows: colors by the embedded profile in sRGB of 8 bits."""
    return (
        f'(let* ((image (car (gimp-file-load RUN-NONINTERACTIVE "{frame}" "{frame}"))))'
        "(if (= (car (gimp-image-base-type image)) RGB)"
        f'(gimp-image-convert-color-profile-from-file image "file://{out.parent / PROFILE}" 1 TRUE))'
        "(gimp-image-convert-precision image 150)"
        "(gimp-image-flatten image)"
        f'(file-png-save RUN-NONINTERACTIVE image (car (gimp-image-get-active-drawable image)) "{out}" "{out}" 0 9 0 0 0 0 0))'
    )
