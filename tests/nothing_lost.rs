//! Nothing is lost: outputs are whole or not there, inputs stay as they are, and who gets nothing hears of it.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::fs::{self, OpenOptions};
use std::io::{Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use support::TREE;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop, path_of, programs};

/// Kills of one kind that are tried.
const KILLS: u32 = 60;
/// However slow the machine is, each kind of kills ends after this.
const KILLING: Duration = Duration::from_secs(3);

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A command line behind a line of the shell, which ends in `exec`.
fn after(shop: &Workshop, shell: &str, line: &str) -> Command {
    let mut words = line.split(' ');
    let mut command = shop.command("sh -c");
    command.arg(format!("{shell} \"$0\" \"$@\"")).arg(path_of(words.next().unwrap())).args(words);
    command
}

fn signal_to(child: &Child, signal: Signal) {
    kill(Pid::from_raw(child.id().cast_signed()), signal).unwrap();
}

/// Whether the tests run where a signal is ignored, as under `nohup`: programs then ignore it too.
fn is_ignored(signal: Signal) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    let is_ignored = mask.is_some_and(|mask| mask >> (signal as i32 - 1) & 1 == 1);
    if is_ignored {
        eprintln!("skipped: {signal} is ignored where the tests run");
    }
    is_ignored
}

/// Numbers below `end` that are the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }
}

/// Each line would write what it reads: by the name of a sidecar, by a link, through an option.
#[test]
#[allow(clippy::too_many_lines, reason = "a table of cases")]
fn inputs_are_never_written() {
    let shop = Workshop::with_frames();
    let copy = |from: &str, to: &str| fs::copy(shop.path(from), shop.path(to)).map(drop).unwrap();
    for (from, to) in [
        ("expected.exr.yaml", "q.exr.yaml"),
        ("noisy.exr.yaml", "q.txt"),
        ("noisy.exr.yaml", "q.png"),
        ("matrix.yaml", "m.exr.yaml"),
        ("expected.exr", "i.exr.yaml"),
        ("xyz.exr", "x.exr"),
    ] {
        copy(from, to);
    }
    for (from, to) in [
        ("kaf-5101ce.yaml", "s.exr.yaml"),
        ("kaf5101ce_est_qe_1nm.csv", "kaf5101ce_est_qe_1nm.csv"),
        ("bg39_1mm.csv", "bg39_1mm.csv"),
    ] {
        fs::copy(format!("{TREE}/sample_data/sensors/{from}"), shop.path(to)).unwrap();
    }
    fs::copy(format!("{TREE}/sample_data/skies/sky912_meta.csv"), shop.path("labels.csv")).unwrap();
    fs::copy(format!("{TREE}/sample_data/skies/clear_zenith.csv"), shop.path("sky.csv")).unwrap();
    shop.pipe("render-radiance --dark --size 8x6 | add-noise | digitize -o d.exr");
    fs::hard_link(shop.path("noisy.exr"), shop.path("hard.exr")).unwrap();
    std::os::unix::fs::symlink("noisy.exr", shop.path("soft.exr")).unwrap();
    std::os::unix::fs::symlink("noisy.exr.yaml", shop.path("new.exr.yaml")).unwrap();
    let all = || shop.files().into_iter().map(|name| (shop.bytes(&name), name)).collect::<Vec<_>>();
    let before = all();
    for (line, output, input) in [
        ("add-noise --metadata q.exr.yaml expected.exr -o q.exr", "q.exr.yaml", "q.exr.yaml"),
        ("to-xyz rgb.exr --matrix m.exr.yaml -o m.exr", "m.exr.yaml", "m.exr.yaml"),
        ("digitize noisy.exr --sensor s.exr.yaml -o s.exr", "s.exr.yaml", "s.exr.yaml"),
        ("digitize noisy.exr --sensor ./s.exr.yaml -o bg39_1mm.csv --format exr", "bg39_1mm.csv", "./bg39_1mm.csv"),
        ("add-noise i.exr.yaml -o i.exr", "i.exr.yaml", "i.exr.yaml"),
        ("measure noisy.exr --metadata q.txt -o q.txt", "q.txt", "q.txt"),
        ("preview noisy.exr --metadata q.png -o ./q.png", "./q.png", "q.png"),
        ("mosaic noisy.exr -o noisy.exr.yaml --format exr", "noisy.exr.yaml", "noisy.exr.yaml"),
        ("mosaic noisy.exr --metadata q.txt -o noisy.exr.yaml --format exr", "noisy.exr.yaml", "noisy.exr.yaml"),
        ("mosaic noisy.exr -o new.exr", "new.exr.yaml", "noisy.exr.yaml"),
        ("mosaic noisy.exr -o hard.exr", "hard.exr", "noisy.exr"),
        ("measure soft.exr -o hard.exr", "hard.exr", "soft.exr"),
        ("correct-frame codes.exr --dark d.exr -o d.exr", "d.exr", "d.exr"),
        ("color-difference xyz.exr x.exr --map x.exr", "x.exr", "x.exr"),
        ("color-difference xyz.exr x.exr -o xyz.exr.yaml", "xyz.exr.yaml", "xyz.exr.yaml"),
        ("predict-noise sky.csv --sensor s.exr.yaml -o sky.csv", "sky.csv", "sky.csv"),
        ("predict-noise --dark --sensor s.exr.yaml -o bg39_1mm.csv", "bg39_1mm.csv", "bg39_1mm.csv"),
        ("predict-noise --dark --matrix m.exr.yaml -o m.exr.yaml", "m.exr.yaml", "m.exr.yaml"),
        ("fit-matrix SAMPLES/skies/sky912.exr --labels labels.csv:aerosol -o labels.csv", "labels.csv", "labels.csv"),
        ("render-radiance sky.csv --size 8x6 -o sky.csv --format exr", "sky.csv", "sky.csv"),
    ] {
        let done = shop.attempt(line, &[]);
        let program = line.split(' ').next().unwrap();
        let wanted = format!("{program}: {output}: it is the same file as the input {input}; name another output\n");
        assert_eq!(said(&done), wanted, "{line}");
        assert_eq!(done.status.code(), Some(BAD_USAGE), "{line}");
        assert!(all() == before, "{line} has changed a file");
    }
    // What the shell opens is no other file than what options name.
    for line in ["measure noisy.exr", "mosaic hard.exr"] {
        let log = OpenOptions::new().append(true).open(shop.path("noisy.exr")).unwrap();
        let done = shop.command(line).stdout(log).output().unwrap();
        assert_eq!(done.status.code(), Some(BAD_USAGE), "{line}: {}", said(&done));
        assert!(all() == before, "{line} has changed a file");
    }
}

#[test]
fn the_standard_input_is_one_input() {
    let shop = Workshop::with_frames();
    let codes = shop.bytes("codes.exr");
    for line in [
        "correct-frame --dark - -",
        "correct-frame --dark -",
        "correct-frame codes.exr --dark - --dark -",
        "add-noise --metadata -",
        "to-xyz - --matrix -",
        "color-difference - -",
    ] {
        let input = if line.starts_with("to-xyz") { shop.bytes("rgb.exr") } else { codes.clone() };
        let done = shop.attempt(line, &input);
        let program = line.split(' ').next().unwrap();
        let wanted = format!("{program}: only one input can be the standard input; name a file for the others\n");
        assert_eq!((said(&done), done.status.code()), (wanted, Some(BAD_USAGE)), "{line}");
    }
    let matrix = shop.bytes("matrix.yaml");
    shop.run("to-xyz rgb.exr --matrix - -o a.exr", &matrix);
    assert_eq!(shop.read("a.exr").0, shop.read("xyz.exr").0);
}

/// Rust's runtime opens `/dev/null` in the place of what is closed: the programs must not take it for an output.
#[test]
#[cfg(target_os = "linux")]
fn closed_streams_are_no_streams() {
    let shop = Workshop::with_frames();
    let mut lines: Vec<String> = programs().iter().map(|program| format!("{program} --help")).collect();
    lines.extend(
        ["measure noisy.exr", "add-noise expected.exr", "mosaic codes.exr --format tiff", "preview noisy.exr -o -"]
            .map(str::to_owned),
    );
    lines.extend(["predict-noise --dark", "color-difference 1,2,3 4,5,6", "add-noise --version"].map(str::to_owned));
    for line in &lines {
        let program = line.split(' ').next().unwrap();
        let done = after(&shop, "exec >&-;", line).output().unwrap();
        assert_eq!(said(&done), format!("{program}: standard output: cannot write: it is closed\n"), "{line}");
        assert_eq!(done.status.code(), Some(BAD_DATA), "{line}");
        // A disk that is full from the first byte on; the limit of file sizes stands for one that fills up.
        let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let done = shop.command(line).stdout(full).output().unwrap();
        assert_eq!(
            said(&done),
            format!("{program}: standard output: cannot write: no space left on device\n"),
            "{line}"
        );
        assert_eq!(done.status.code(), Some(BAD_DATA), "{line}");
        // Where nobody hears, the status tells.
        let done = after(&shop, "exec >&- 2>&-;", line).output().unwrap();
        assert_eq!((said(&done).as_str(), done.status.code()), ("", Some(BAD_DATA)), "{line}");
    }
    let done = after(&shop, "exec <&-;", "measure").output().unwrap();
    assert_eq!(said(&done), "measure: standard input: cannot open: it is closed\n");
    // Who needs none of them does without.
    let done = after(&shop, "exec <&- >&- 2>&-;", "mosaic codes.exr -o alone.exr").output().unwrap();
    assert!(done.status.success());
    assert_eq!(shop.bytes("alone.exr"), shop.bytes("plane.exr"));
}

#[test]
fn a_dash_is_the_standard_output() {
    let shop = Workshop::with_frames();
    let files = shop.files();
    let picture = shop.run("preview noisy.exr -o -", &[]);
    assert!(picture.starts_with(b"\x89PNG"));
    assert_eq!(shop.run("mosaic codes.exr -o -", &[]), shop.run("mosaic codes.exr", &[]));
    assert_eq!(shop.files(), files);
    shop.run("preview noisy.exr -o picture.png", &[]);
    assert_eq!(shop.bytes("picture.png"), picture);
}

/// The verdict counts though nobody reads the report to its end.
#[test]
fn a_closed_pipe_hides_no_verdict() {
    let shop = Workshop::with_frames();
    // At this level every test of a prediction fails.
    let mut child = shop.spawn("measure --check --level 1 noisy.exr", Stdio::null());
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(BAD_DATA));
}

/// A frame that takes a while to make, and the bytes of what add-noise makes of it.
fn with_large_frame() -> (Workshop, Vec<u8>, Vec<u8>) {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 100,200,300 --size 240x160 -o in.exr", &[]);
    shop.run("add-noise in.exr --compression zip -o whole.exr", &[]);
    let (whole, sidecar) = (shop.bytes("whole.exr"), shop.bytes("whole.exr.yaml"));
    fs::remove_file(shop.path("whole.exr")).unwrap();
    fs::remove_file(shop.path("whole.exr.yaml")).unwrap();
    (shop, whole, sidecar)
}

/// Whatever ends a program at whatever moment, an output is whole, with its sidecar, or not there.
#[test]
fn a_killed_program_leaves_a_whole_output_or_none() {
    let (shop, whole, sidecar) = with_large_frame();
    let mut dice = Dice(7);
    for signal in [Signal::SIGTERM, Signal::SIGINT, Signal::SIGHUP, Signal::SIGKILL] {
        if is_ignored(signal) {
            continue;
        }
        let (start, mut ended) = (Instant::now(), [0, 0]);
        // The time that a run takes where nothing ends it.
        shop.run("add-noise in.exr --compression zip -o out.exr", &[]);
        let run = start.elapsed();
        for number in 0..KILLS {
            let is_new = number % 2 == 0;
            if is_new {
                fs::remove_file(shop.path("out.exr")).unwrap();
                drop(fs::remove_file(shop.path("out.exr.yaml")));
            }
            let mut child = shop.spawn("add-noise in.exr --compression zip -o out.exr", Stdio::null());
            thread::sleep(Duration::from_micros(dice.below(u64::try_from(run.as_micros()).unwrap() * 5 / 4)));
            signal_to(&child, signal);
            let status = child.wait().unwrap();
            assert!(status.success() || status.signal() == Some(signal as i32), "{signal}: {status}");
            ended[usize::from(status.success())] += 1;
            let mut files = shop.files();
            if signal == Signal::SIGKILL {
                // Between its two names, a file that replaces another may keep the first; it is whole.
                files.retain(|name| {
                    let is_left = name.starts_with(".cyanometer-");
                    if is_left {
                        let bytes = shop.bytes(name);
                        assert!(bytes == whole || bytes == sidecar, "{name} is not whole");
                        fs::remove_file(shop.path(name)).unwrap();
                    }
                    !is_left
                });
            }
            match files.join(" ").as_str() {
                "in.exr in.exr.yaml" if is_new && !status.success() => {}
                // The image has its name just before the sidecar.
                "in.exr in.exr.yaml out.exr" if signal == Signal::SIGKILL => assert!(shop.bytes("out.exr") == whole),
                "in.exr in.exr.yaml out.exr out.exr.yaml" => {
                    assert!(
                        shop.bytes("out.exr") == whole && shop.bytes("out.exr.yaml") == sidecar,
                        "{signal} {number}"
                    );
                }
                other => panic!("{signal} leaves {other}"),
            }
            if !shop.path("out.exr").exists() {
                shop.run("add-noise in.exr --compression zip -o out.exr", &[]);
            }
            if start.elapsed() > KILLING {
                break;
            }
        }
        assert!(ended[0] > 0, "{signal} has met no program at work");
    }
}

/// A program that waits for the rest of its input: what it has, and what it still wants.
fn waiting(shop: &Workshop, line: &str, input: &[u8]) -> Child {
    let mut child = shop.spawn(line, Stdio::piped());
    child.stdin.as_mut().unwrap().write_all(&input[..input.len() - 100]).unwrap();
    // It has opened its output once it sleeps over its input; half of a second is long for that, and if it is not enough the
    // test passes all the same.
    thread::sleep(Duration::from_millis(500));
    child
}

#[test]
fn programs_die_of_signals_and_leave_alone_what_is_ignored() {
    let (shop, ..) = with_large_frame();
    let (input, files) = (shop.bytes("in.exr"), shop.files());
    for signal in [Signal::SIGHUP, Signal::SIGINT, Signal::SIGQUIT, Signal::SIGTERM, Signal::SIGKILL] {
        if is_ignored(signal) {
            continue;
        }
        let mut child = waiting(&shop, "add-noise --compression zip -o out.exr", &input);
        // Held open: a program whose input ends, ends too.
        let _stdin = child.stdin.take();
        signal_to(&child, signal);
        assert_eq!(child.wait().unwrap().signal(), Some(signal as i32));
        assert_eq!(shop.files(), files, "{signal}");
    }
    // As `nohup` starts programs.
    let mut command = after(&shop, "trap '' HUP; exec", "add-noise --compression zip -o out.exr");
    let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(&input[..input.len() - 100]).unwrap();
    thread::sleep(Duration::from_millis(300));
    signal_to(&child, Signal::SIGHUP);
    thread::sleep(Duration::from_millis(100));
    stdin.write_all(&input[input.len() - 100..]).unwrap();
    drop(stdin);
    assert!(child.wait().unwrap().success());
    assert_eq!(shop.files().join(" "), "in.exr in.exr.yaml out.exr out.exr.yaml");
}

#[test]
fn a_file_that_may_not_grow_is_an_error() {
    let (shop, whole, _) = with_large_frame();
    fs::write(shop.path("noisy.exr"), whole).unwrap();
    let files = shop.files();
    // The limit counts in blocks of 512 or 1024 bytes.
    for line in [
        "add-noise in.exr -o out.exr",
        "add-noise in.exr -o out.tiff",
        "mosaic noisy.exr --compression zip -o out.exr",
        "preview noisy.exr --range 0,400 -o out.png",
        "predict-noise --sweep 10:40000:50log -o out.csv",
        "predict-noise --sweep 10:40000:50log --plot out.svg",
    ] {
        let done = after(&shop, "ulimit -f 4; exec", line).output().unwrap();
        let (program, out) = (line.split(' ').next().unwrap(), line.rsplit(' ').next().unwrap());
        assert_eq!(said(&done), format!("{program}: {out}: cannot write: file too large\n"), "{line}");
        assert_eq!((done.status.code(), shop.files()), (Some(BAD_DATA), files.clone()), "{line}");
    }
}

#[test]
fn a_directory_that_goes_away_takes_nothing_along() {
    let (shop, ..) = with_large_frame();
    let (input, files) = (shop.bytes("in.exr"), shop.files());
    fs::create_dir(shop.path("gone")).unwrap();
    let mut child = waiting(&shop, "add-noise -o gone/out.exr", &input);
    fs::remove_dir_all(shop.path("gone")).unwrap();
    child.stdin.take().unwrap().write_all(&input[input.len() - 100..]).unwrap();
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(BAD_DATA));
    assert_eq!(said(&done), "add-noise: gone/out.exr: cannot write: no such file or directory\n");
    assert_eq!(shop.files(), files);
}

/// Every stage behind one that is killed fails; the first of them says why in a line, the others have nothing to add. No name is given
/// to anything.
#[test]
fn a_stage_that_is_killed_fails_all_behind_it() {
    let (shop, ..) = with_large_frame();
    let (input, files) = (shop.bytes("in.exr"), shop.files());
    let mut killed = waiting(&shop, "add-noise", &input);
    let mut before = killed.stdout.take().unwrap();
    let mut behind = Vec::new();
    for line in ["digitize", "mosaic", "demosaic -o out.exr"] {
        let mut child = shop.spawn(line, Stdio::from(before));
        before = child.stdout.take().unwrap();
        behind.push((line, child));
    }
    signal_to(&killed, Signal::SIGKILL);
    killed.wait().unwrap();
    for (index, (line, mut child)) in behind.into_iter().enumerate() {
        let mut complaint = String::new();
        child.stderr.take().unwrap().read_to_string(&mut complaint).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(BAD_DATA), "{line}");
        let is_told = complaint.contains("cut short") || complaint.contains("it is empty");
        // What is on its way to a slow reader when a program fails does not let the pipe be marked.
        assert!(is_told || (index > 0 && complaint.is_empty()), "{line}: {complaint}");
    }
    assert_eq!(shop.files(), files);
}

#[test]
fn two_writers_of_one_name_leave_one_whole_file() {
    let (shop, whole, _) = with_large_frame();
    shop.run("add-noise in.exr --seed 1 --compression zip -o other.exr", &[]);
    let other = shop.bytes("other.exr");
    for round in 0..20 {
        let lines =
            ["add-noise in.exr --compression zip -o out.exr", "add-noise in.exr --seed 1 --compression zip -o out.exr"];
        let children = lines.map(|line| shop.spawn(line, Stdio::null()));
        for child in children {
            let done = child.wait_with_output().unwrap();
            assert!(done.status.success(), "{}", said(&done));
        }
        let left = shop.bytes("out.exr");
        assert!(left == whole || left == other, "round {round}");
        assert_eq!(shop.files().join(" "), "in.exr in.exr.yaml other.exr other.exr.yaml out.exr out.exr.yaml");
        if round % 2 == 0 {
            fs::remove_file(shop.path("out.exr")).unwrap();
            fs::remove_file(shop.path("out.exr.yaml")).unwrap();
        }
    }
}

/// Names that a reader of YAML might take for something else stand in the history, and are read again.
#[test]
fn metadata_are_read_whatever_files_are_called() {
    let names =
        ["Sky & Sun", &"[".repeat(40), &"-".repeat(140), "a: {b", "\u{1b}[2J\u{85}\u{2028}\n# &x *x !x", "𝄞'\"\\"];
    for name in names {
        let shop = Workshop::with_frames();
        fs::create_dir(shop.path(name)).unwrap();
        let place = |file: &str| format!("./{name}/{file}");
        let run = |program: &str, words: &[&str]| {
            let done = shop.command(program).args(words).output().unwrap();
            assert!(done.status.success() && done.stderr.is_empty(), "{name:?}: {}", said(&done));
        };
        fs::copy(shop.path("expected.exr"), shop.path(&place("in.exr"))).unwrap();
        run("add-noise", &[&place("in.exr"), "-o", &place("a.exr")]);
        run("digitize", &[&place("a.exr"), "--metadata", &place("a.exr.yaml"), "-o", &place("b.tiff")]);
        run("mosaic", &[&place("b.tiff"), "--metadata", &place("b.tiff.yaml"), "-o", &place("c.exr")]);
        fs::remove_file(shop.path(&place("c.exr.yaml"))).unwrap();
        for _ in 0..3 {
            run("demosaic", &[&place("c.exr"), "-o", &place("d.exr")]);
        }
        let history = shop.sidecar(&place("d.exr")).history;
        let given = history.iter().flat_map(|entry| &entry.arguments).filter(|word| word.contains(name)).count();
        assert_eq!(given, 6, "{name:?}: {history:?}");
    }
}

#[test]
fn every_reader_tells_of_a_sidecar_that_is_not_its_images() {
    let shop = Workshop::with_frames();
    fs::copy(shop.path("noisy.exr"), shop.path("other.exr")).unwrap();
    shop.run("add-noise expected.exr --seed 8 -o noisy.exr", &[]);
    fs::rename(shop.path("other.exr"), shop.path("noisy.exr")).unwrap();
    for line in ["preview noisy.exr -o a.png", "measure noisy.exr", "mosaic noisy.exr", "digitize noisy.exr -o a.exr"] {
        let done = shop.attempt(line, &[]);
        let program = line.split(' ').next().unwrap();
        assert_eq!(
            said(&done),
            format!(
                "{program}: warning: noisy.exr: its samples are not those that noisy.exr.yaml describes; one of the two was \
                 changed\n"
            )
        );
        assert!(done.status.success(), "{line}");
    }
}

/// What stands in files neither steers the terminal nor floods it.
#[test]
fn text_from_files_is_tame() {
    let shop = Workshop::with_frames();
    let labels = fs::read_to_string(format!("{TREE}/sample_data/skies/sky912_meta.csv")).unwrap();
    fs::write(shop.path("labels.csv"), labels.replace("maritime23", "\u{1b}[2J\u{9b}1m\u{202e}")).unwrap();
    fs::write(shop.path("long.yaml"), format!("schema: \"{}\"\nquantity: adu\n", "\\ex".repeat(100_000))).unwrap();
    fs::write(shop.path("word.yaml"), format!("{}\n", "y".repeat(100_000))).unwrap();
    fs::write(shop.path("key.yaml"), format!("\"{}\": 1\n", "\\ez".repeat(300))).unwrap();
    for line in [
        "fit-matrix SAMPLES/skies/sky912.exr --labels labels.csv:aerosol --evaluate SAMPLES/skies/sky912.exr",
        "fit-matrix SAMPLES/skies/sky912.exr --labels labels.csv:aerosol --hold-out none",
        "measure noisy.exr --metadata long.yaml",
        "measure noisy.exr --metadata word.yaml",
        "predict-noise --dark --sensor key.yaml",
        "render-radiance long.yaml",
    ] {
        let done = shop.attempt(line, &[]);
        let shown = String::from_utf8(done.stdout.clone()).unwrap() + &said(&done);
        let steers = |c: char| c.is_control() && c != '\n' || c == '\u{202E}';
        assert!(!shown.contains(steers), "{line}: {shown:?}");
        assert!(done.stderr.len() < 2000, "{line}: {} bytes", done.stderr.len());
    }
}
