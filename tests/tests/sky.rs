//! `passes` and `look` by the real program: what they tell, against Skyfield's passes, and what they say to bad input.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use end_to_end::binary::workspace;
use end_to_end::process::{gs_server, run};
use serde_json::{Value, json};
use tempfile::TempDir;

const NAME: &str = "ISS (ZARYA)";
const ONE: &str = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992";
const TWO: &str = "2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008";
const LAUSANNE: &str = "Lausanne=46.5191,6.5668,410";

/// Exit code, standard output, standard error.
type Said = (i32, String, String);

fn folder() -> TempDir {
    tempfile::Builder::new().prefix("gs-sky-").tempdir().expect("a temporary folder")
}

fn file(folder: &TempDir, text: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join("elements.txt");
    std::fs::write(&path, text).expect("a file of elements");
    path
}

fn iss() -> String {
    format!("{NAME}\n{ONE}\n{TWO}\n")
}

/// `passes` of a day over Lausanne.
fn passes(elements: &Path, more: &[&str]) -> Said {
    let mut command = gs_server(["passes", "--station", LAUSANNE, "--start", "2020-07-13", "--elements"]);
    command.arg(elements).args(more);
    run(command)
}

fn passes_in(text: impl AsRef<[u8]>, more: &[&str]) -> Said {
    let folder = folder();
    passes(&file(&folder, text), more)
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("one JSON object")
}

fn says(text: &str, wanted: &[&str]) {
    for wanted in wanted {
        assert!(text.contains(wanted), "'{wanted}' is not in: {text}");
    }
}

/// A line with other columns from `column` on, and the right checksum.
fn with(line: &str, column: usize, text: &str) -> String {
    let mut changed = line[..68].to_owned();
    changed.replace_range(column - 1..column - 1 + text.len(), text);
    let sum: u32 = changed.chars().map(|c| if c == '-' { 1 } else { c.to_digit(10).unwrap_or(0) }).sum();
    format!("{changed}{}", sum % 10)
}

/// Microseconds since 1970 of `2020-07-13T00:36:48.454062Z`.
fn unix_us(time: &Value) -> i64 {
    let time = time.as_str().expect("a time");
    assert!(time.len() == 27 && time.ends_with('Z'), "{time}");
    time.parse::<api::FineTime>().expect("a time").unix_us()
}

// ---- what they tell

/// Every search of the vectors whose passes all begin and end at the threshold.
#[test]
fn passes_are_those_of_skyfield_to_the_millisecond() {
    let text = std::fs::read_to_string(workspace().join("tle/vectors/passes.txt")).expect("vectors");
    let mut compared = 0;
    for record in text.split("\n\n").filter(|record| record.contains("search: low orbit")).step_by(4) {
        let value = |key: &str| {
            record.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(": ")).expect("a value")
        };
        let numbers = |text: &str| -> Vec<f64> {
            text.split_whitespace().map(|word| word.parse().expect("a number")).collect()
        };
        let time =
            |key: &str| api::FineTime::from_unix_us(value(key).parse().expect("microseconds")).to_string();
        let e = numbers(value("elements"));
        let station: Vec<String> = numbers(value("station")).iter().map(f64::to_string).collect();
        let omm = json!([{
            "OBJECT_NAME": "VECTOR", "NORAD_CAT_ID": 100_001, "EPOCH": time("epoch_us"), "MEAN_MOTION": e[0],
            "ECCENTRICITY": e[1], "INCLINATION": e[2], "RA_OF_ASC_NODE": e[3], "ARG_OF_PERICENTER": e[4],
            "MEAN_ANOMALY": e[5], "BSTAR": e[6],
        }]);
        let folder = folder();
        let path = file(&folder, omm.to_string());
        let (start, stop) = (time("start_us"), time("stop_us"));
        let station = station.join(",");
        let mut command = gs_server(["passes", "--station", &station, "--start", &start, "--stop", &stop]);
        command.args([
            "--min-elevation",
            value("threshold_deg"),
            "--frequency",
            "435e6",
            "--json",
            "--elements",
        ]);
        let (code, out, error) = run({
            command.arg(&path);
            command
        });
        assert_eq!((code, error.as_str()), (0, ""), "{}", value("search"));
        let answer = json(&out);
        let start_us: i64 = value("start_us").parse().expect("microseconds");
        let known: Vec<Vec<&str>> = record
            .lines()
            .filter_map(|line| line.strip_prefix("pass: "))
            .map(|line| line.split(' ').collect())
            .collect();
        let found = answer["passes"].as_array().expect("passes");
        assert_eq!(found.len(), known.len(), "{}", value("search"));
        for (found, known) in found.iter().zip(known) {
            for (time, clipped, known) in
                [("aos", "aos_clipped", &known[..3]), ("los", "los_clipped", &known[3..6])]
            {
                assert_eq!(found[clipped], json!(known[0] != "cross"), "{}: {found}", value("search"));
                let number = |at: usize| known[at].parse::<f64>().expect("a number");
                let off_s = ((unix_us(&found[time]) - start_us) as f64 / 1e6 - number(1)).abs();
                assert!(
                    off_s < f64::max(1e-3, 1e-5 / number(2).abs()),
                    "{}: {time} {off_s} s off",
                    value("search")
                );
                compared += 1;
            }
            let highest: f64 = known[6].parse().expect("degrees");
            let told = found["max_elevation_deg"].as_f64().expect("degrees");
            assert!((told - highest).abs() < 5e-4, "{told} {highest}");
        }
    }
    assert!(compared >= 200, "{compared}");
}

#[test]
fn pass_tells_all_that_was_promised_and_looks_agree_with_it() {
    let folder = folder();
    let path = file(&folder, iss());
    let (code, out, error) = passes(&path, &["--stop", "+1d", "--frequency", "437e6", "--json"]);
    assert_eq!((code, error.as_str()), (0, ""));
    let answer = json(&out);
    let pass = &answer["passes"][0];
    assert_eq!((&pass["satellite"], &pass["norad_cat_id"]), (&json!(NAME), &json!(25544)));
    assert_eq!((&pass["station"], &pass["aos_clipped"]), (&json!("Lausanne"), &json!(false)));
    assert_eq!(pass["epoch"], json!("2020-07-12T21:16:01.000416Z"));
    assert!(
        pass["aos_doppler_hz"].as_f64() > Some(9000.0) && pass["los_doppler_hz"].as_f64() < Some(-9000.0)
    );
    let lasts = (unix_us(&pass["los"]) - unix_us(&pass["aos"])) as f64 / 1e6;
    assert!((pass["duration_s"].as_f64().expect("seconds") - lasts).abs() < 1e-9);

    let times: Vec<&str> =
        ["aos", "tca", "los"].iter().map(|key| pass[key].as_str().expect("a time")).collect();
    let at = times.join(",");
    let mut look = gs_server(["look", "--station", LAUSANNE, "--frequency", "437e6", "--json", "--at", &at]);
    look.arg("--elements").arg(&path);
    let (code, out, error) = run(look);
    assert_eq!((code, error.as_str()), (0, ""));
    let answer = json(&out);
    for (point, look) in ["aos", "tca", "los"].iter().zip(answer["looks"].as_array().expect("looks")) {
        for (mine, theirs) in [
            (format!("{point}_azimuth_deg"), "azimuth_deg"),
            (format!("{point}_range_km"), "range_km"),
            (format!("{point}_range_rate_km_s"), "range_rate_km_s"),
            (format!("{point}_doppler_hz"), "doppler_hz"),
        ] {
            let (a, b) = (pass[&mine].as_f64().expect("a number"), look[theirs].as_f64().expect("a number"));
            assert!((a - b).abs() < 1e-4, "{mine} {a}, {theirs} {b}");
        }
        assert_eq!(pass[format!("{point}_sunlit")], json!(look["eclipse"] == "sunlit"));
        let heard = look["received_hz"].as_f64().expect("Hz") - 437e6;
        assert!((heard - look["doppler_hz"].as_f64().expect("Hz")).abs() < 1e-6);
        assert!(look["height_km"].as_f64().is_some_and(|km| (400.0..450.0).contains(&km)), "{look}");
    }
}

#[test]
fn window_cuts_are_flagged_with_the_true_ends_and_table_plots_and_calendar_are_written() {
    let folder = folder();
    let path = file(&folder, iss());
    let mut cut =
        gs_server(["passes", "--station", LAUSANNE, "--start", "2020-07-13T00:40:00Z", "--stop", "+5m"]);
    cut.args(["--json", "--elements"]).arg(&path);
    let (_, out, _) = run(cut);
    let pass = &json(&out)["passes"][0];
    assert_eq!((&pass["aos_cause"], &pass["los_cause"]), (&json!("window"), &json!("window")));
    assert_eq!(pass["true_aos"], json!("2020-07-13T00:36:48.454062Z"));
    assert_eq!(pass["aos_doppler_hz"], Value::Null, "no frequency was given");

    let inside = |name: &str| folder.path().join(name).display().to_string();
    let (svg, timeline, ics) = (inside("a.svg"), inside("t.svg"), inside("a.ics"));
    let (code, out, error) = passes(&path, &["--svg", &svg, "--timeline", &timeline, "--ics", &ics]);
    assert_eq!((code, error.as_str()), (0, ""));
    says(&out, &["AOS (UTC)", "2020-07-13 00:36:48Z", "visible", "10m37s"]);
    let read = |path: &str| std::fs::read_to_string(path).expect("a file");
    says(&read(&svg), &["<svg ", ">\nAOS", "ISS (ZARYA)", "over Lausanne", "</svg>"]);
    says(&read(&timeline), &["<svg ", "Lausanne", "</svg>"]);
    says(&read(&ics), &["BEGIN:VCALENDAR\r\n", "DTSTART:20200713T003648Z\r\n", "END:VCALENDAR\r\n"]);
}

#[test]
fn elements_come_from_standard_input_too() {
    let mut command =
        gs_server(["passes", "--station", LAUSANNE, "--start", "2020-07-13", "--elements", "-", "--json"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program starts");
    child.stdin.take().expect("its input").write_all(iss().as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("its end");
    assert!(output.status.success());
    assert_eq!(json(&String::from_utf8_lossy(&output.stdout))["satellites"], json!(1));
}

// ---- bad input

#[test]
fn oddities_of_published_files_are_accepted() {
    let accepted = [
        (
            "line ends, blanks, mark, comments",
            format!("\u{feff}# today\r\n\r\n{NAME}  \t\r\n{ONE}  \r\n\r\n{TWO}\t\r\n"),
        ),
        ("text after column 69", format!("{ONE}\n{TWO}     0.00      4320.0        360.00\n")),
        ("number padded with blanks", format!("{}\n{}\n", with(ONE, 3, "  511"), with(TWO, 3, "  511"))),
        (
            "blank fields",
            format!("{}\n{TWO}\n", with(&with(&with(ONE, 10, "        "), 63, " "), 65, "    ")),
        ),
        ("leading zeros and plus", format!("{}\n{TWO}\n", with(&with(ONE, 45, "+10762-4"), 54, " 00000+0"))),
    ];
    for (what, text) in accepted {
        let (code, out, error) = passes_in(&text, &["--json"]);
        assert_eq!((code, error.as_str()), (0, ""), "{what}");
        assert!(json(&out)["passes"].as_array().is_some_and(|passes| passes.len() > 4), "{what}");
    }
    for (what, text, wanted) in [
        ("no checksum", format!("{}\n{}\n", &ONE[..68], &TWO[..68]), "TLE line 1 has no checksum"),
        ("epoch with blanks", format!("{}\n{TWO}\n", with(ONE, 19, "20  1.123     ")), "padded with blanks"),
    ] {
        let (code, out, error) = passes_in(&text, &["--json"]);
        assert_eq!(code, 0, "{what}: {error}");
        says(&error, &["elements.txt, line 1", wanted]);
        json(&out);
    }
}

#[test]
fn broken_set_costs_only_itself_and_is_named_with_line_and_remedy() {
    let broken = [
        (
            "checksum",
            format!("{ONE}\n{}7\n", &TWO[..68]),
            "line 4 (object 25544): the checksum of TLE line 2 is 7, but the line adds up to 8",
        ),
        (
            "two numbers",
            format!("{ONE}\n{}\n", with(TWO, 3, "25545")),
            "line 1 is of object 25544 and line 2 of object 25545",
        ),
        ("line 2 missing", format!("{ONE}\n"), "TLE line 2 is missing"),
        ("shifted column", format!("1  {}\n{TWO}\n", &ONE[2..68]), "TLE line 1, column"),
        ("special blank", format!("{}\n{TWO}\n", ONE.replacen(' ', "\u{a0}", 1)), "\\u{a0}"),
        ("small letter", format!("{}\n{TWO}\n", with(ONE, 3, "a5544")), "column 3 (catalogue number)"),
        ("inclination", format!("{ONE}\n{}\n", with(TWO, 9, "180.1000")), "INCLINATION is '180.1"),
        ("mean motion", format!("{ONE}\n{}\n", with(TWO, 53, "00.00000000")), "MEAN_MOTION is '0"),
        ("day 0", format!("{}\n{TWO}\n", with(ONE, 19, "20000.00000000")), "wanted 1 to 365"),
        ("SGP4-XP", format!("{}\n{TWO}\n", with(ONE, 63, "4")), "EPHEMERIS_TYPE 0"),
    ];
    for (what, text, wanted) in broken {
        let sound = format!("{}\n{}\n", with(ONE, 3, "90001"), with(TWO, 3, "90001"));
        let more = format!("{}\n{}\n", with(ONE, 3, "90002"), with(TWO, 3, "90002"));
        let all = format!("{sound}{text}{more}");
        let (code, out, error) = passes_in(&all, &["--json", "--stop", "+2h"]);
        assert_eq!(code, 1, "{what}: {error}");
        says(&error, &["elements.txt, line ", wanted, "of 3 sets refused"]);
        let answer = json(&out);
        assert_eq!(answer["satellites"], json!(2), "{what}: {error}");
        assert_eq!(answer["refused"].as_array().map(Vec::len), Some(1), "{what}: {error}");
    }
    let (code, out, error) = passes_in(format!("{ONE}\n{}7\n", &TWO[..68]), &["--lenient"]);
    assert_eq!(code, 0, "{error}");
    says(&error, &["used all the same"]);
    says(&out, &["object 25544"]);
}

#[test]
fn several_epochs_are_all_kept_and_the_newest_before_is_used() {
    let later = with(ONE, 19, "20195.38612269");
    let (code, out, _) = passes_in(format!("{later}\n{TWO}\n{ONE}\n{TWO}\n"), &["--json"]);
    let answer = json(&out);
    assert_eq!((code, &answer["satellites"]), (0, &json!(1)));
    for pass in answer["passes"].as_array().expect("passes") {
        let before = unix_us(&pass["aos"]) < unix_us(&json!("2020-07-13T09:16:01.000416Z"));
        let epoch = if before { "2020-07-12T21:16:01.000416Z" } else { "2020-07-13T09:16:01.000416Z" };
        assert_eq!(pass["epoch"], json!(epoch), "{pass}");
    }
}

#[test]
fn what_is_no_elements_is_said_with_the_remedy_and_nothing_is_half_printed() {
    let sources: [(&[u8], &str); 9] = [
        (b"<!DOCTYPE html><html><head><title>403 Forbidden</title></head></html>", "web page ('403 Forbidden')"),
        (b"{\"error\":\"You must be logged in\"}", "answered with a message instead"),
        (b"No GP data found", "check the catalogue number"),
        (b"", "the text is empty"),
        (b"[]", "no elements for this query"),
        (b"The quick brown fox", "this is no form of elements"),
        (b"\xff\xfe1\x00", "save it as UTF-8"),
        (b"\x1f\x8b\x00\x00", "unpack it first"),
        (b"[{\"OBJECT_NAME\":\"A\",\"EPHEMERIS_TYPE\":4,\"EPOCH\":\"2020-07-13T00:00:00\",\"MEAN_MOTION\":15.5,\"ECCENTRICITY\":0.001,\
           \"INCLINATION\":51,\"RA_OF_ASC_NODE\":1,\"ARG_OF_PERICENTER\":2,\"MEAN_ANOMALY\":3,\"BSTAR\":0,\"NORAD_CAT_ID\":7}]",
         "Fetch the ordinary GP elements (EPHEMERIS_TYPE 0)"),
    ];
    for (bytes, wanted) in sources {
        let (code, out, error) = passes_in(bytes, &["--json"]);
        assert_eq!((code, out.as_str()), (1, ""), "{error}");
        says(&error, &["elements.txt", wanted]);
    }
    let (code, out, error) = passes(Path::new("/nowhere/gp.json"), &["--json"]);
    assert_eq!((code, out.as_str()), (1, ""));
    says(&error, &["/nowhere/gp.json cannot be opened", "No such file"]);
}

#[test]
fn arguments_that_make_no_sense_are_refused_with_what_they_may_be() {
    let refused: [(&[&str], &[&str]); 9] = [
        (&["--station", "91,0,0"], &["the latitude 91 is outside -90 to 90"]),
        (&["--station", "46.5,6.5"], &["LATITUDE,LONGITUDE,HEIGHT"]),
        (&["--station", LAUSANNE], &["two stations are called 'Lausanne'"]),
        (
            &["--stop", "2020-07-12"],
            &["ends at 2020-07-12T00:00:00.000000Z, before it begins", "exchange the two"],
        ),
        (&["--stop", "tomorrow"], &["'tomorrow' is no instant in UTC", "+7d"]),
        (&["--stop", "2040-01-01"], &["search at most 3653"]),
        (&["--min-elevation", "91"], &["outside -90 to 90 degrees"]),
        (&["--dut1", "1.5"], &["kept within 0.9 s"]),
        (&["--frequency", "437"], &["give hertz, such as 435.4e6"]),
    ];
    let folder = folder();
    let path = file(&folder, iss());
    for (more, wanted) in refused {
        let (code, out, error) = passes(&path, &[more, &["--json"]].concat());
        assert_eq!((code, out.as_str()), (2, ""), "{more:?}: {error}");
        says(&error, wanted);
    }
    let (code, _, error) = passes(&path, &["--satellite", "ZARYA"]);
    assert_eq!(code, 1);
    says(&error, &["no satellite 'ZARYA'", "ISS (ZARYA)"]);
    let (code, out, error) = run(gs_server(["passes", "--station", LAUSANNE]));
    assert_eq!((code, out.as_str()), (2, ""));
    says(&error, &["no elements: give --elements FILE"]);
    let (code, _, error) =
        run(gs_server(["look", "--station", LAUSANNE, "--elements", "x", "--at", "2020-13-01T00:00:00Z"]));
    assert_eq!(code, 2);
    says(&error, &["'2020-13-01T00:00:00Z' is no instant in UTC"]);
}
