"""What scripts/install and scripts/package make: programs that run from where they were put, pages, completions, an archive and
a package of Debian's that hold the same, with every licence."""

import gzip
import os
import pathlib
import re
import shutil
import subprocess
import tarfile
import tempfile
import unittest

from programs import BINARIES, ROOT

PROGRAMS = sorted(source.stem for source in (ROOT / "src/bin").iterdir())


def run(*command, **options):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True, timeout=600, **options).stdout


class BuiltCase(unittest.TestCase):
    """The programs at hand, without what debuggers need."""

    @classmethod
    def setUpClass(cls):
        directory = tempfile.TemporaryDirectory(prefix="cyanometer-")
        cls.addClassCleanup(directory.cleanup)
        cls.directory = pathlib.Path(directory.name)
        cls.built = cls.directory / "built"
        cls.built.mkdir()
        for program in PROGRAMS:
            run("strip", "-o", cls.built / program, BINARIES / program)


class Installed(BuiltCase):
    """One installation for all tests."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.prefix = cls.directory / "a prefix"
        cls.said = run(ROOT / "scripts/install", "--prefix", cls.prefix, "--built", cls.built)

    def test_programs_run_from_there_with_their_data(self):
        self.assertIn(str(self.prefix), self.said)
        environment = {"PATH": f"{self.prefix}/bin:/usr/bin:/bin"}
        command = "render-radiance --electrons 100,200,300 --size 8x6 | cyanometer add-noise | measure"
        told = run("bash", "-c", command, env=environment, cwd=self.directory)
        self.assertIn("48 pixels of electrons", told)
        self.assertGreater(len(run("cyanometer", env=environment).splitlines()), len(PROGRAMS))
        source = {path.relative_to(ROOT / "sample_data") for path in (ROOT / "sample_data").rglob("*") if path.is_file()}
        data = self.prefix / "share/cyanometer"
        self.assertEqual({path.relative_to(data) for path in data.rglob("*") if path.is_file()}, source)

    def test_examples_that_name_spectra_run_in_any_directory(self):
        environment = {"PATH": f"{self.prefix}/bin:/usr/bin:/bin"}
        elsewhere = self.directory / "elsewhere"
        elsewhere.mkdir()
        count = 0
        for program in ("fit-matrix", "render-radiance"):
            text = run(program, "--help", env=environment).split("\nExamples:\n")[1].replace(" \\\n      ", " ")
            for line in text.splitlines():
                if line.startswith("  ") and not line.startswith("  #"):
                    run("bash", "-e", "-c", line, env=environment, cwd=elsewhere)
                    count += 1
        self.assertGreaterEqual(count, 6)
        # Metadata name the spectrum as it was given, whatever the prefix.
        self.assertIn("source: clear_zenith.csv\n", (elsewhere / "expected.exr.yaml").read_text())
        self.assertNotIn(str(self.prefix), (elsewhere / "expected.exr.yaml").read_text())
        # What lies at hand comes first.
        (elsewhere / "clear_zenith.csv").write_text("no spectrum\n")
        done = subprocess.run(["bash", "-c", "render-radiance clear_zenith.csv"], env=environment, cwd=elsewhere,
                              capture_output=True, text=True, check=False)
        self.assertIn("clear_zenith.csv: ", done.stderr)

    def test_pages_and_completions_are_there_for_every_program(self):
        share = self.prefix / "share"
        for program in PROGRAMS:
            page = (share / f"man/man1/{program}.1").read_text()
            self.assertIn(".TH", page)
            script = share / f"bash-completion/completions/{program}"
            self.assertIn(f"{program}\n", run("bash", "-c", f"source '{script}'; complete -p {program}"))
            # What begins no option is a file, which bash offers where the script offers nothing.
            offered = f"source '{script}'; COMP_WORDS=({program} x); COMP_CWORD=1; _{program} {program} x {program}"
            if program != "cyanometer":
                self.assertEqual(run("bash", "-c", f"{offered}; echo ${{#COMPREPLY[@]}}"), "0\n")
            self.assertTrue((share / f"zsh/site-functions/_{program}").read_text().startswith(f"#compdef {program}"))
            self.assertIn(f"complete -c {program}", (share / f"fish/vendor_completions.d/{program}.fish").read_text())

    def test_documents_lead_to_nothing_that_is_not_there(self):
        document = self.prefix / "share/doc/cyanometer"
        pages = [document / "README.md", *(document / "docs").rglob("*.md")]
        links = [(page, link) for page in pages for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text())]
        self.assertGreater(len(links), 100)
        self.assertEqual([(page.name, link) for page, link in links if not (page.parent / link).exists()], [])

    def test_a_second_installation_replaces_the_first(self):
        run(ROOT / "scripts/install", "--prefix", self.prefix, "--built", self.built)
        self.assertEqual(sorted(path.name for path in (self.prefix / "bin").iterdir()), PROGRAMS)

    def test_a_missing_program_and_wrong_words_are_refused(self):
        for words in (["--built", self.directory], ["--prefx", "x"], ["--prefix"]):
            done = subprocess.run([ROOT / "scripts/install", *words], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1), done.stderr)


class Packaged(BuiltCase):
    """An archive, and the package of Debian where cargo-deb is at hand."""

    def package(self, kind):
        # A copy of the tree, as its commit is: target/dist of the checkout is left alone.
        tree = self.directory / f"tree-{kind}"
        listed = run("git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard").splitlines()
        for name in listed:
            if (ROOT / name).is_file():
                (tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, tree / name)
        environment = dict(os.environ, CARGO_TARGET_DIR=str(ROOT / "target"), SOURCE_DATE_EPOCH="1700000000")
        run(tree / "scripts/package", kind, "--built", self.built, env=environment, cwd=tree)
        return tree / "target/dist"

    def test_the_archive_holds_programs_and_every_licence(self):
        made = self.package("archive")
        (file,) = made.glob("*.tar.gz")
        with tarfile.open(file) as archive:
            names = archive.getnames()
            self.assertTrue(all(member.uid == 0 and member.mtime == 1700000000 for member in archive.getmembers()))
            top = names[0]
            for program in PROGRAMS:
                self.assertIn(f"{top}/bin/{program}", names)
            text = archive.extractfile(f"{top}/share/doc/cyanometer/THIRD-PARTY.txt").read().decode()
        tree = run("cargo", "tree", "--locked", "--edges=normal,no-proc-macro", "--prefix=none", "--format={p}", cwd=ROOT)
        for line in tree.splitlines():
            name, version = line.split()[:2]
            self.assertTrue(name == "cyanometer" or f"  {name} {version[1:]}: " in text, line)
        self.assertIn("GNU LESSER GENERAL PUBLIC LICENSE", text)
        run("sha256sum", "--check", f"{file.name}.sha256", cwd=made)

    @unittest.skipUnless(shutil.which("dpkg-deb") and (shutil.which("cargo-deb") or (ROOT / "target/tools/bin/cargo-deb").exists()),
                         "no dpkg-deb, or no cargo-deb")
    def test_the_debian_package_leaves_plain_names_to_alternatives(self):
        made = self.package("deb")
        (file,) = made.glob("*.deb")
        run("dpkg-deb", "--extract", file, self.directory / "deb")
        run("dpkg-deb", "--control", file, self.directory / "control")
        usr = self.directory / "deb/usr"
        own = {program if program == "cyanometer" else f"cyanometer-{program}" for program in PROGRAMS}
        self.assertEqual({path.name for path in (usr / "bin").iterdir()}, own)
        documents = usr / "share/doc/cyanometer"
        self.assertIn("Linked with rawler", (documents / "copyright").read_text())
        self.assertIn("(changelog.gz)", (documents / "README.md").read_text())
        self.assertTrue((documents / "changelog.gz").exists())
        install, remove = ((self.directory / "control" / script).read_text() for script in ("postinst", "prerm"))
        for program in PROGRAMS:
            if program != "cyanometer":
                self.assertIn(f"--install /usr/bin/{program} {program} /usr/bin/cyanometer-{program} ", install)
                self.assertIn(f"--remove {program} /usr/bin/cyanometer-{program}\n", remove)
                page = gzip.decompress((usr / f"share/man/man1/cyanometer-{program}.1.gz").read_bytes())
                self.assertIn(b".TH", page)
        # The front door finds them by those names.
        told = run(usr / "bin/cyanometer", "measure", "--version", env={"PATH": "/usr/bin:/bin"})
        self.assertTrue(told.startswith("measure (cyanometer)"), told)
        script = usr / "share/bash-completion/completions/cyanometer-measure"
        self.assertEqual(run("bash", "-c", f"source '{script}'; complete -p measure cyanometer-measure").count("\n"), 2)


if __name__ == "__main__":
    unittest.main()
