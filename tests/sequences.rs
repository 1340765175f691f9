//! Frames one after another: in streams and files, drawn together or alone, resumed, and told apart.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::fs;
use std::process::Output;
use std::time::UNIX_EPOCH;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Reports of frames, a line of JSON each.
fn lines(report: &[u8]) -> Vec<serde_json::Value> {
    let text = String::from_utf8_lossy(report);
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"))).collect()
}

fn with_scene() -> Workshop {
    let shop = Workshop::new();
    shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
    shop.run("render-radiance --electrons 4000,6000,8000 --size 24x16 -o scene.exr", &[]);
    shop
}

const CHAIN: [&str; 4] = ["digitize", "mosaic", "demosaic --method eci", "to-xyz --matrix matrix.yaml --sigma"];

/// The chain run once over all exposures gives what it gives of each alone, to the byte: in pipes and in files, of one range or of
/// several, on any number of threads.
#[test]
fn exposures_are_the_same_together_and_alone() {
    let shop = with_scene();
    fs::create_dir(shop.path("n")).unwrap();
    fs::create_dir(shop.path("m")).unwrap();
    let mut together = shop.run("add-noise scene.exr --seed 5 --frames 7..12", &[]);
    for threads in [1, 3] {
        shop.run(
            &format!("add-noise scene.exr --seed 5 --frames 7..10 --threads {threads} -o n/{{frame:03}}.exr"),
            &[],
        );
        shop.run(
            &format!("add-noise scene.exr --seed 5 --frames 10..12 --threads {threads} -o n/{{frame:03}}.exr"),
            &[],
        );
    }
    let one = |frame: u32| shop.run(&format!("add-noise scene.exr --seed 5 --frame {frame}"), &[]);
    let mut alone: Vec<Vec<u8>> = (7..12).map(one).collect();
    for (frame, bytes) in (7..12).zip(&alone) {
        assert!(*bytes == shop.bytes(&format!("n/{frame:03}.exr")), "frame {frame}");
    }
    for line in CHAIN {
        shop.run(&format!("{line} -o {{index}}.exr"), &together);
        together = shop.run(line, &together);
        alone = alone.iter().map(|bytes| shop.run(line, bytes)).collect();
        for (index, bytes) in alone.iter().enumerate() {
            assert!(*bytes == shop.bytes(&format!("{index}.exr")), "{line}, frame {index}");
        }
    }
    // Files by their names: the name of the input is part of the history, and of the others nothing.
    shop.run("digitize n/007.exr n/008.exr n/009.exr n/010.exr n/011.exr -o m/", &[]);
    for frame in 7..12 {
        let name = format!("n/{frame:03}.exr");
        shop.run(&format!("digitize {name} -o one.exr"), &[]);
        assert!(shop.bytes(&format!("m/{frame:03}.exr")) == shop.bytes("one.exr"), "frame {frame}");
        assert_eq!(shop.sidecar("one.exr").history.last().unwrap().arguments, [name]);
    }
}

/// The samples of a measure of each frame are those of the frame alone; with `--check`, each is tested.
#[test]
fn each_frame_is_measured() {
    let shop = with_scene();
    let stream = shop.run("add-noise scene.exr --frames 3..6", &[]);
    let reports = lines(&shop.run("measure --check --output-format json", &stream));
    assert_eq!(reports.iter().map(|report| report["frame"].as_u64().unwrap()).collect::<Vec<_>>(), [3, 4, 5]);
    for (frame, report) in (3..6).zip(&reports) {
        let alone = shop.run(&format!("add-noise scene.exr --frame {frame}"), &[]);
        let alone: serde_json::Value =
            serde_json::from_slice(&shop.run("measure --check --output-format json", &alone)).unwrap();
        assert_eq!((&report["regions"], &report["check"]), (&alone["regions"], &alone["check"]));
        assert_eq!(report["file"], "standard input");
    }
    let table = String::from_utf8(shop.run("measure --output-format csv", &stream)).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((rows.len(), rows[0].len(), rows[9].len()), (10, rows[5].len(), rows[0].len()));
    assert_eq!((rows[0].ends_with(&["file", "frame"]), rows[9].ends_with(&["standard input", "5"])), (true, true));
    // One wrong among three: all are reported, and the run fails.
    let mut wrong = stream.clone();
    let end = wrong.len() - 400;
    wrong[end..end + 4].copy_from_slice(&1e9_f32.to_le_bytes());
    let output = shop.attempt("measure --check --output-format json", &wrong);
    assert_eq!((output.status.code(), lines(&output.stdout).len()), (Some(BAD_DATA), 3));
    let complaint = said(&output);
    assert!(complaint.contains("1 of 3 frames are not as predicted, the first of them frame 5"), "{complaint}");
}

/// Of a pipe whose first program fails, before its first frame or behind some, the user hears once; all programs fail.
#[test]
fn a_failure_is_told_once() {
    let shop = with_scene();
    let programs = std::path::Path::new(env!("CARGO_BIN_EXE_mosaic")).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let rest = "digitize | mosaic | demosaic | to-xyz --matrix matrix.yaml | measure --output-format csv";
    for (first, wanted) in [
        ("add-noise missing.exr", &["add-noise: missing.exr: cannot open: no such file or directory"][..]),
        ("add-noise --no-such-option", &["add-noise: unknown option"]),
        (
            "render-radiance missing.csv | add-noise --frames 0..3",
            &["render-radiance: missing.csv: cannot open: no such file or directory"],
        ),
        (
            "add-noise scene.exr missing.exr --frames 0..3",
            &["add-noise: missing.exr: cannot open", "add-noise: 1 of 2 inputs failed; the others are done"],
        ),
        // A stream of which nobody knows how many frames it has.
        (
            "add-noise < <(cat scene.exr scene.exr; echo junk)",
            &["add-noise: standard input: behind its last row come bytes that are no part of it"],
        ),
    ] {
        let script = format!("{first} | {rest}; echo ${{PIPESTATUS[@]}} >&2");
        let mut shell = std::process::Command::new("bash");
        let done = shell.args(["-c", &script]).env("PATH", &path).current_dir(shop.path(".")).output().unwrap();
        let said = said(&done);
        let mut lines: Vec<&str> = said.lines().collect();
        let statuses = lines.pop().unwrap_or_default();
        assert!(statuses.split(' ').all(|status| status == "1" || status == "2"), "{first}: {statuses}\n{said}");
        assert_eq!(lines.len(), wanted.len(), "{first}: {said}");
        assert!(lines.iter().zip(wanted).all(|(line, wanted)| line.starts_with(wanted)), "{first}: {said}");
    }
    // What another program does not send is told.
    let said = said(&shop.attempt("mosaic", &[]));
    assert_eq!(said, "mosaic: standard input: it is empty; the program before it wrote nothing\n");
}

/// Of frames of which one was taken at another temperature nothing is made, and the complaint names what was set, not what follows of it.
#[test]
fn statistics_are_of_all_frames_or_none() {
    let shop = with_scene();
    for (name, options) in [("a", "--frame 0"), ("b", "--frame 1"), ("warm", "--frame 2 --temperature 310")] {
        let electrons = shop.run(&format!("add-noise scene.exr --seed 3 {options}"), &[]);
        shop.run(&format!("digitize -o {name}.exr"), &electrons);
    }
    for line in ["measure --over frames", "average-frames -o mean.exr"] {
        let done = shop.attempt(&format!("{line} a.exr b.exr warm.exr"), &[]);
        let said = said(&done);
        assert!(said.contains("warm.exr: its `noise.temperature_k` is 310.0, but that of a.exr is 333.0"), "{said}");
        assert!(said.ends_with("1 of 3 inputs failed; nothing is made of the others\n"), "{said}");
        assert!(done.stdout.is_empty() && done.status.code() == Some(BAD_DATA) && !shop.path("mean.exr").exists());
    }
}

/// What was made of a file that was changed since is made anew, whatever tells its name; what was made of others stays.
#[test]
fn what_is_made_of_a_changed_file_is_made_anew() {
    let shop = Workshop::new();
    fs::create_dir(shop.path("r")).unwrap();
    fs::create_dir(shop.path("p")).unwrap();
    for (name, electrons) in [("a", "400,600,800"), ("b", "500,500,500"), ("c", "900,800,700")] {
        shop.run(&format!("render-radiance --electrons {electrons} --size 24x16 -o {name}.exr"), &[]);
        shop.run(&format!("preview {name}.exr --range 0,1000 -o {name}.png"), &[]);
    }
    let lines = [
        "render-radiance a.png --illuminant d65 --luminance 100 --resume -o r/a.exr",
        "render-radiance b.png --illuminant d65 --luminance 100 --resume -o r/b.exr",
        "mosaic r/a.exr r/b.exr --resume -o p/",
    ];
    let all = ["r/a.exr", "r/b.exr", "p/a.exr", "p/b.exr", "p/a-noisy.exr", "p/b-noisy.exr"];
    let run = || {
        lines.iter().for_each(|line| drop(shop.run(line, &[])));
        let planes = shop.run("mosaic r/a.exr r/b.exr", &[]);
        shop.run("add-noise --seed 3 --resume -o p/{stem}-noisy.exr", &planes);
        all.map(|name| (shop.bytes(name), fs::metadata(shop.path(name)).unwrap().modified().unwrap()))
    };
    let first = run();
    assert!(run() == first);
    fs::copy(shop.path("c.png"), shop.path("a.png")).unwrap();
    let second = run();
    for (index, name) in all.iter().enumerate() {
        let is_of_a = name.contains("/a");
        assert_eq!(first[index].0 != second[index].0, is_of_a, "{name}");
        assert_eq!(first[index].1 != second[index].1, is_of_a, "{name}");
    }
    let output = shop.attempt("mosaic r/a.exr --resume", &[]);
    assert_eq!(
        (output.status.code(), said(&output).trim_end()),
        (
            Some(BAD_USAGE),
            "mosaic: a stream keeps nothing of an earlier run; name files for what is made; leave out --resume"
        )
    );
}

/// What is complete stays as it is; what is damaged, missing, or would be another is made, and all is as in one run.
#[test]
fn a_run_is_resumed() {
    let shop = with_scene();
    fs::create_dir(shop.path("n")).unwrap();
    let line = "add-noise scene.exr --seed 2 --frames 0..6 --resume -o n/{frame}.exr";
    shop.run(line, &[]);
    let whole: Vec<[Vec<u8>; 2]> =
        (0..6).map(|frame| ["", ".yaml"].map(|end| shop.bytes(&format!("n/{frame}.exr{end}")))).collect();
    let times = || {
        (0..6)
            .map(|frame| fs::metadata(shop.path(&format!("n/{frame}.exr"))).unwrap().modified().unwrap())
            .collect::<Vec<_>>()
    };
    let before = times();
    // A sample, the end, the sidecar, the whole, a word of the description.
    let mut changed = whole[0][0].clone();
    let last = changed.len() - 10;
    changed[last] ^= 1;
    fs::write(shop.path("n/0.exr"), changed).unwrap();
    fs::write(shop.path("n/1.exr"), &whole[1][0][..last]).unwrap();
    fs::remove_file(shop.path("n/2.exr.yaml")).unwrap();
    fs::remove_file(shop.path("n/3.exr")).unwrap();
    let other = String::from_utf8(whole[4][1].clone()).unwrap().replace("seed: 2", "seed: 3");
    fs::write(shop.path("n/4.exr.yaml"), other).unwrap();
    shop.run(line, &[]);
    for (frame, [image, sidecar]) in whole.iter().enumerate() {
        assert!(shop.bytes(&format!("n/{frame}.exr")) == *image, "frame {frame}");
        assert!(shop.bytes(&format!("n/{frame}.exr.yaml")) == *sidecar, "frame {frame}");
    }
    let after = times();
    let is_made: Vec<bool> = before.iter().zip(&after).map(|(before, after)| before != after).collect();
    assert_eq!(is_made, [true, true, true, true, true, false]);
    // Another seed is another run.
    shop.run(&line.replace("--seed 2", "--seed 3"), &[]);
    assert!((0..6).all(|frame| shop.bytes(&format!("n/{frame}.exr")) != whole[frame][0]));
    // Frames of a stream that are complete are passed over.
    let stream = shop.run("add-noise scene.exr --seed 2 --frames 0..6", &[]);
    fs::create_dir(shop.path("c")).unwrap();
    shop.run("digitize -o c/{frame}.exr", &stream);
    let codes = shop.bytes("c/5.exr");
    fs::remove_file(shop.path("c/5.exr")).unwrap();
    shop.run("digitize --resume -o c/{frame}.exr", &stream);
    assert!(shop.bytes("c/5.exr") == codes);
    // So do other dark frames of the same names, other defects of one list, another type of samples.
    shop.run("render-radiance --dark --size 24x16 -o dark-scene.exr", &[]);
    let correct = "correct-frame -q c/5.exr --dark dark.exr --defects list.csv --resume -o less.exr";
    let (mut made, mut kept) = (Vec::new(), Vec::new());
    for (seed, list) in [(3, "3,4"), (4, "3,4"), (4, "7,8"), (4, "7,8")] {
        let electrons = shop.run(&format!("add-noise dark-scene.exr --seed {seed}"), &[]);
        shop.run("digitize -o dark.exr", &electrons);
        fs::write(shop.path("list.csv"), list).unwrap();
        // Of old files only what they hold tells that they are others.
        for name in ["dark.exr", "dark.exr.yaml", "list.csv"] {
            fs::File::options().append(true).open(shop.path(name)).unwrap().set_modified(UNIX_EPOCH).unwrap();
        }
        let before = fs::metadata(shop.path("less.exr")).and_then(|file| file.modified()).ok();
        shop.run(correct, &[]);
        kept.push(before == fs::metadata(shop.path("less.exr")).and_then(|file| file.modified()).ok());
        made.push(shop.bytes("less.exr"));
    }
    assert_eq!(kept, [false, false, false, true]);
    assert!(made[0] != made[1] && made[1] != made[2] && made[2] == made[3]);
    shop.run("digitize -q n/5.exr --resume --sample-type f16 -o half.exr", &[]);
    let half = shop.bytes("half.exr");
    shop.run("digitize -q n/5.exr --resume -o half.exr", &[]);
    assert!(shop.bytes("half.exr") != half);
}

/// Two frames that links bring to one place are told.
#[test]
fn links_lead_to_one_place() {
    let shop = with_scene();
    fs::create_dir(shop.path("r1")).unwrap();
    std::os::unix::fs::symlink(shop.path("r1"), shop.path("r0")).unwrap();
    let done = shop.attempt("add-noise scene.exr --frames 0..2 -o r{frame}/x.exr", &[]);
    assert!(
        done.status.code() == Some(BAD_DATA) && said(&done).contains("another frame of this run"),
        "{}",
        said(&done)
    );
}

/// What stands behind a frame is a frame, or the run fails; a stream that is cut fails too.
#[test]
fn what_is_no_frame_is_refused() {
    let shop = with_scene();
    let frame = shop.bytes("scene.exr");
    let two = [frame.as_slice(), &frame].concat();
    fs::write(shop.path("two.exr"), &two).unwrap();
    fs::write(shop.path("junk.exr"), [two.as_slice(), b"junk"].concat()).unwrap();
    let junk = "behind its last row come bytes that are no part of it; cut them off";
    for (line, input, status, wanted) in [
        ("measure", [two.as_slice(), b"x"].concat(), BAD_DATA, junk),
        ("measure junk.exr", Vec::new(), BAD_DATA, junk),
        ("add-noise", two[..two.len() - 7].to_vec(), BAD_DATA, "frame 1: the file ends before its last row"),
        ("add-noise", two[..frame.len() + 60].to_vec(), BAD_DATA, "frame 1"),
        ("add-noise -o a.exr", two.clone(), BAD_USAGE, "a.exr: another frame of this run went there"),
        ("add-noise -o b{frame}.exr", two.clone(), BAD_USAGE, "b0.exr: another frame of this run went there"),
        ("add-noise --format tiff", two.clone(), BAD_USAGE, "each is an EXR"),
        ("preview -o p.png", two.clone(), BAD_USAGE, "p.png: another frame of this run went there"),
        ("color-difference - scene.exr --space xyz", two.clone(), BAD_DATA, ""),
        (
            "add-noise scene.exr -o none/{frame}.exr --frames 0..9",
            Vec::new(),
            BAD_DATA,
            "there is no directory `none`; make it first",
        ),
        ("add-noise scene.exr --frames 3..3", Vec::new(), BAD_USAGE, "0..100 for 0 to 99"),
        ("add-noise scene.exr --frames 0..3 --frame 1", Vec::new(), BAD_USAGE, "--frame"),
        ("add-noise scene.exr --frames 0..3 -o same.exr", Vec::new(), BAD_USAGE, "3 exposures would go there"),
        ("digitize -o {stem}.exr", two.clone(), BAD_USAGE, "the standard input tells no name for {stem}"),
        ("digitize scene.exr -o a{n}.exr", Vec::new(), BAD_USAGE, "nothing stands for {n}"),
        (
            "mosaic scene.exr none.exr -o m-{stem}.exr",
            Vec::new(),
            BAD_DATA,
            "1 of 2 frames failed; the others are done",
        ),
        ("mosaic scene.exr - -o m-{stem}.exr", Vec::new(), BAD_USAGE, "the standard input cannot be one of several"),
    ] {
        let output = shop.attempt(line, &input);
        let complaint = said(&output);
        assert_eq!(output.status.code(), Some(status), "{line}: {complaint}");
        assert!(complaint.contains(wanted), "{line}: {complaint}");
    }
    assert!(shop.path("m-scene.exr").exists());
    // Bytes behind a frame that are none leave no named file, from a pipe either, nor does a failure of the program before.
    let with_junk = [frame.as_slice(), b"junk"].concat();
    for (line, name) in [
        ("add-noise -o left.exr", "left.exr"),
        ("mosaic --format tiff -o left.tiff", "left.tiff"),
        ("preview -o left.png", "left.png"),
        ("preview --caption -o left2.png", "left2.png"),
        ("measure -o left.txt", "left.txt"),
        ("measure -o left.csv", "left.csv"),
        ("measure --plot left.svg", "left.svg"),
    ] {
        let output = shop.attempt(line, &with_junk);
        assert!(output.status.code() == Some(BAD_DATA) && said(&output).contains(junk), "{line}: {}", said(&output));
        assert!(!shop.path(name).exists() && !shop.path(&format!("{name}.yaml")).exists(), "{line}");
    }
    // Frames of a file, and those of several files in one stream.
    assert_eq!(lines(&shop.run("measure two.exr --output-format json", &[])).len(), 2);
    let stream = shop.run("mosaic two.exr scene.exr", &[]);
    assert_eq!(lines(&shop.run("measure --output-format json", &stream)).len(), 3);
    // A crop reads on behind its last row.
    assert_eq!(lines(&shop.run("measure --crop 2,2,4,4 --output-format json", &two)).len(), 2);
    shop.run("preview -o p{index:02}.png", &two);
    assert!(shop.path("p00.png").exists() && shop.path("p01.png").exists());
}

/// The first byte of a frame of a stream.
fn start_of(stream: &[u8], frame: usize) -> usize {
    const MAGIC: [u8; 4] = [0x76, 0x2F, 0x31, 0x01];
    stream.windows(4).enumerate().filter(|(_, bytes)| *bytes == MAGIC).nth(frame).unwrap().0
}

/// The byte behind the last of a frame of a stream.
fn end_of(stream: &[u8], frame: usize) -> usize {
    const MAGIC: [u8; 4] = [0x76, 0x2F, 0x31, 0x01];
    stream
        .windows(4)
        .enumerate()
        .filter(|(_, bytes)| *bytes == MAGIC)
        .nth(frame + 1)
        .map_or(stream.len(), |found| found.0)
}

/// A program that dies between two frames leaves a stream that tells how many are missing.
#[test]
fn a_stream_knows_how_many_frames_it_has() {
    let shop = with_scene();
    let stream = shop.run("add-noise scene.exr --frames 0..4", &[]);
    let cut = &stream[..start_of(&stream, 2)];
    let missing = "it ends behind 2 frames, and 2 more were to come: the program before has failed";
    for line in ["measure", "digitize", "mosaic -o {index}.exr"] {
        let output = shop.attempt(line, cut);
        assert_eq!(output.status.code(), Some(BAD_DATA), "{line}");
        assert!(said(&output).contains(missing), "{line}: {}", said(&output));
    }
    // So does one whose frames are dropped from the middle, or change places.
    let frame = |number: usize| &stream[start_of(&stream, number)..stream.len().min(end_of(&stream, number))];
    for order in [[0, 2, 3], [1, 0, 2]] {
        let output = shop.attempt("digitize", &order.map(frame).concat());
        assert_eq!(output.status.code(), Some(BAD_DATA), "{order:?}");
        assert!(said(&output).contains("between them some are missing"), "{order:?}: {}", said(&output));
    }
    // Programs in between pass it on.
    let digitized = shop.attempt("digitize", &stream);
    let output = shop.attempt("measure", &digitized.stdout[..start_of(&digitized.stdout, 1)]);
    assert!(said(&output).contains("it ends behind 1 frame, and 3 more were to come"), "{}", said(&output));
    // Files say nothing of others.
    shop.run("add-noise scene.exr --frames 0..2 -o {frame}.exr", &[]);
    let files = [shop.bytes("0.exr"), shop.bytes("1.exr")].concat();
    assert_eq!(lines(&shop.run("measure --output-format json", &files)).len(), 2);
}

/// Names of several files go through pipes: outputs are named by them, and reports name them. The form of a report is that of which its
/// name ends, and CSV has what a check says.
#[test]
fn names_go_through_pipes() {
    let shop = with_scene();
    fs::create_dir(shop.path("n")).unwrap();
    fs::create_dir(shop.path("m")).unwrap();
    shop.run("add-noise scene.exr --seed 5 --frames 0..3 -o n/a{frame}.exr", &[]);
    let codes = shop.run("digitize n/a0.exr n/a1.exr n/a2.exr", &[]);
    let planes = shop.run("mosaic", &codes);
    shop.run("demosaic -o m/", &planes);
    shop.run("demosaic -o m/x-{stem}-{index}.exr", &planes);
    let named = ["a0.exr", "a1.exr", "a2.exr", "x-a0-0.exr", "x-a1-1.exr", "x-a2-2.exr"];
    assert!(named.iter().all(|name| shop.path("m").join(name).exists()));
    assert!(shop.bytes("m/a1.exr") == shop.bytes("m/x-a1-1.exr"));
    // Files say nothing of it; they are those of programs that were run one by one.
    assert!(!String::from_utf8_lossy(&shop.bytes("m/a1.exr.yaml")).contains("\nfile:"));
    assert!(!String::from_utf8_lossy(&shop.run("digitize n/a1.exr", &[])).contains("\nfile:"));
    shop.run("measure --check --level 1e-9 -o rows.csv", &planes);
    let table = String::from_utf8(shop.bytes("rows.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|head| *head == name).unwrap();
    assert_eq!(rows.len(), 1 + 3 * 4);
    for (row, name) in rows[1..].chunks(4).zip(["n/a0.exr", "n/a1.exr", "n/a2.exr"]) {
        assert!(row.iter().all(|row| row[column("file")] == name && row[column("as_predicted")] == "true"), "{table}");
    }
    for (ending, begins) in
        [("json", "{"), ("yml", "---"), ("txt", "n/a0.exr, frame 0:"), ("report", "n/a0.exr, frame 0:")]
    {
        shop.run(&format!("measure -o r.{ending}"), &planes);
        let text = shop.bytes(&format!("r.{ending}"));
        assert!(text.starts_with(begins.as_bytes()), "{ending}");
    }
    shop.run("measure --output-format json -o r.csv", &planes);
    assert!(shop.bytes("r.csv").starts_with(b"{"));
}

/// Names in quotes are expanded by the program: the same bytes as by a shell; numbers of frames do for several inputs, and two that meet
/// are told. A report of all goes to one file, and figures of each do not.
#[test]
fn names_stand_for_several_files() {
    let shop = with_scene();
    fs::create_dir(shop.path("n")).unwrap();
    fs::create_dir(shop.path("m")).unwrap();
    shop.run("add-noise scene.exr --seed 5 --frames 0..3 -o n/{frame}.exr", &[]);
    let by_shell = shop.run("digitize n/0.exr n/1.exr n/2.exr", &[]);
    assert!(shop.run("digitize n/*.exr", &[]) == by_shell);
    shop.run("digitize n/*.exr -o m/c-{frame:02}.tiff", &[]);
    assert!(shop.path("m/c-02.tiff").exists());
    let index = shop.attempt("digitize n/*.exr -o m/i-{index}.tiff", &[]);
    assert!(index.status.code() == Some(BAD_DATA) && said(&index).contains("another frame of this run went there"));
    let darks = "correct-frame n/0.exr --dark n/[12].exr -o m/less.exr";
    // Electrons are no codes; that both were found is what counts.
    assert!(said(&shop.attempt(darks, &[])).contains("electrons"));
    for (line, wanted) in [
        ("measure n/0.exr n/1.exr --plot m/p.svg", "one of each of 2 frames would go there"),
        ("measure n/0.exr n/1.exr -o {stem}.csv", "go to one file"),
        ("add-noise scene.exr --frames 4294967290..4294967300", "numbers are 0 to 4294967295"),
    ] {
        let refused = shop.attempt(line, &[]);
        assert_eq!(refused.status.code(), Some(BAD_USAGE), "{line}: {}", said(&refused));
        assert!(said(&refused).contains(wanted), "{line}: {}", said(&refused));
        assert!(!shop.path("m/p.svg").exists());
    }
}

/// What the first program of a pipe reads the last does not write over; nor are sidecars of inputs, whatever comes of the rest.
#[test]
fn inputs_upstream_and_sidecars_stay() {
    let shop = with_scene();
    fs::create_dir(shop.path("n")).unwrap();
    shop.run("add-noise scene.exr --seed 5 --frames 0..3 -o n/a{frame}.exr", &[]);
    let all = || ["a0.exr", "a1.exr", "a2.exr", "a1.exr.yaml"].map(|name| shop.bytes(&format!("n/{name}")));
    let before = all();
    let codes = shop.run("digitize n/a0.exr n/a1.exr n/a2.exr", &[]);
    for line in ["mosaic -o n/{stem}.exr", "mosaic -o n/a{frame}.exr", "average-frames -o n/a2.exr"] {
        let refused = shop.attempt(line, &codes);
        assert!(said(&refused).contains("it is the same file as the input n/a"), "{line}: {}", said(&refused));
        assert_ne!(refused.status.code(), Some(0), "{line}");
    }
    for line in [
        "measure n/a0.exr n/a1.exr -o n/a1.exr.yaml",
        "measure --over frames n/a0.exr n/a1.exr -o n/a1.exr.yaml",
        "measure --over frames n/a0.exr n/a1.exr --pixels n/p.exr -o n/p.exr.yaml",
    ] {
        let refused = shop.attempt(line, &[]);
        assert_eq!(refused.status.code(), Some(BAD_USAGE), "{line}: {}", said(&refused));
    }
    assert!(all() == before && !shop.path("n/p.exr").exists());
    // A directory named after its input need not be there before its name is known.
    fs::create_dir(shop.path("n/a1")).unwrap();
    let codes = shop.run("digitize n/a1.exr n/a1.exr", &[]);
    shop.run("mosaic -o n/{stem}/{index}.exr", &codes);
    assert!(shop.path("n/a1/1.exr").exists());
    shop.run("measure n/a0.exr n/a1.exr -o lines.jsonl", &[]);
    assert_eq!(lines(&shop.bytes("lines.jsonl")).len(), 2);
}

/// An exposure counts once, also within averages and by its file or its samples, where no seed is told.
#[test]
fn exposures_count_once() {
    let shop = with_scene();
    shop.run("add-noise scene.exr --seed 5 --frames 0..8 -o e{frame}.exr", &[]);
    shop.run("average-frames e0.exr e1.exr e2.exr -o first.exr", &[]);
    shop.run("average-frames e2.exr e3.exr e5.exr -o second.exr", &[]);
    shop.run("average-frames e4.exr e6.exr e7.exr -o third.exr", &[]);
    let runs = |name: &str| -> Vec<[u64; 3]> {
        shop.sidecar(name).averaged.iter().map(|run| [run.seed, run.first.into(), run.last.into()]).collect()
    };
    assert_eq!(runs("second.exr"), [[5, 2, 3], [5, 5, 5]]);
    let twice = shop.attempt("average-frames first.exr second.exr -o both.exr", &[]);
    assert!(said(&twice).contains("exposure 2 of seed 5 comes twice"), "{}", said(&twice));
    shop.run("average-frames first.exr third.exr -o both.exr", &[]);
    assert_eq!(runs("both.exr"), [[5, 0, 2], [5, 4, 4], [5, 6, 7]]);
    // Frames of a camera have no seeds.
    let plain = |name: &str, changed: &str| {
        shop.run(&format!("digitize {changed} -o {name}.tiff"), &[]);
        fs::remove_file(shop.path(&format!("{name}.tiff.yaml"))).unwrap();
    };
    plain("a", "e0.exr");
    plain("b", "e1.exr");
    for line in ["average-frames a.tiff b.tiff ./a.tiff -o m.exr", "measure --over frames a.tiff b.tiff a.tiff"] {
        let refused = shop.attempt(line, &[]);
        assert!(said(&refused).contains("a.tiff: it is given twice as an exposure"), "{}", said(&refused));
        assert_eq!(refused.status.code(), Some(BAD_USAGE));
    }
    shop.run("digitize e0.exr -o a.exr", &[]);
    let mut copy = shop.sidecar("a.exr");
    copy.noise = None;
    fs::copy(shop.path("a.exr"), shop.path("b.exr")).unwrap();
    for name in ["a", "b"] {
        let text =
            cyanometer::formats::yaml::write_metadata(&cyanometer::metadata::Metadata { scene: None, ..copy.clone() });
        fs::write(shop.path(&format!("{name}.exr.yaml")), text.unwrap()).unwrap();
    }
    let copies = shop.attempt("average-frames a.exr b.exr -o m.exr", &[]);
    assert!(said(&copies).contains("its samples are those of a.exr, every one"), "{}", said(&copies));
    assert!(!shop.path("m.exr").exists());
}
