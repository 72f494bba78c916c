//! Each field wrong once: line, field, and remedy.

use mission::UtcUs;
use mission::plan::{Action, CheckContext, PassShape, approval};
use protocol::Telecommand;
use radio::airtime::LinkTiming;

use super::template::Template;
use super::*;

/// 2026-11-22T00:00:00Z.
const NOW: UtcUs = UtcUs(1_795_305_600_000_000);

fn context(pass: Option<(u64, f64)>) -> CheckContext {
    CheckContext {
        timing: LinkTiming::default(),
        profile: Some(mission::Profile::default()),
        pass: pass.map(|(duration_s, max_elevation_deg)| PassShape {
            duration_us: duration_s * 1_000_000,
            max_elevation_deg: Some(max_elevation_deg),
        }),
        now: Some(NOW),
    }
}

const GOOD: &str = r#"name = "all-of-it"
satellite = "pixelsat-1"
priority = 2
worth = 3.5
transmit = true
at_los = "finish-later"
limit_s = 470
min_pass = { max_elevation_deg = 30, duration_s = 400 }
attach = { min_max_elevation_deg = 30, hours_utc = ["18:00-06:00"], sunlit = true, every = 2 }
[[steps]]
do = "listen"
for_s = 20.5
[[steps]]
do = "wait-for"
until = { heard_within_s = 70 }
timeout_s = 100
on_failure = "skip"
[[steps]]
do = "command"
command = "GetImageChunk"
arguments = { first = 0, count = 8 }
priority = 9
attempts = 2
gate = "heard"
limit_s = 60
when = { elevation_deg = 20, after_aos_s = 30, before_los_s = 60, telemetry = [
  { parameter = "heartbeat.temp", op = "<", value = 40, max_age_s = 120 },
] }
[[steps]]
do = "upload-schedule"
slots = [{ time = "2026-11-23T00:00:00Z", first = 0, count = 8 }]
[[steps]]
do = "command"
command = "Reset"
approved_by = { name = "A. Verma", digest = "DIGEST", expires_at = "2026-12-01T00:00:00Z" }
[[steps]]
do = "repeat-until"
at_most = 3
until = { heard_within_s = 5 }
[[steps.steps]]
do = "listen"
for_s = 5
[[steps]]
do = "download-image"
limit_s = 100
"#;

fn good() -> String {
    GOOD.replace("DIGEST", &approval::digest(&[Telecommand::Reset]))
}

fn look(text: &str) -> CheckedText {
    check_text(text, Form::of(text), &context(None))
}

/// TOML to JSON, a field a line.
fn as_json(text: &str) -> String {
    let value: toml::Value = toml::from_str(text).unwrap();
    serde_json::to_string_pretty(&value).unwrap()
}

#[test]
fn a_good_plan_is_read_in_both_forms_alike() {
    let text = good();
    let toml = look(&text);
    assert!(toml.is_good(), "{:#?}", toml.findings);
    assert_eq!(toml.findings, []);
    let plan = toml.plan.unwrap();
    assert_eq!((plan.name.as_str(), plan.priority, plan.worth), ("all-of-it", 2, 3.5));
    assert_eq!((plan.limit_us, plan.steps.len()), (Some(470_000_000), 7));
    assert_eq!(plan.attach.as_ref().unwrap().hours_utc[0].from_min, 18 * 60);
    let json = look(&as_json(&text));
    assert_eq!(json.findings, []);
    assert_eq!(json.plan.unwrap(), plan);
}

#[test]
fn the_words_of_a_plan_go_out_as_they_came_in() {
    let words = read(&good(), Form::Toml).unwrap();
    let text = serde_json::to_string(&words).unwrap();
    assert_eq!(read(&text, Form::Json).unwrap(), words);
}

/// What is put for what; the place, and words of the message.
#[rustfmt::skip]
const WRONG: &[(&str, &str, &str, &str)] = &[
    (r#"name = "all-of-it""#, r#"name = "All of it""#, "name", "is not a name"),
    (r#"satellite = "pixelsat-1""#, r#"satellite = """#, "satellite", "the configuration"),
    ("priority = 2", "priority = 99999", "priority", "i16"),
    ("worth = 3.5", "worth = -1", "worth", "Give 0 to 1000000"),
    ("worth = 3.5", "worth = nan", "worth", "Give 0 to 1000000"),
    ("worth = 3.5", "wort = 3.5", "wort", "Did you mean 'worth'?"),
    ("transmit = true", "transmit = \"yes\"", "transmit", "boolean"),
    ("at_los = \"finish-later\"", "at_los = \"finish-latr\"", "at_los", "Did you mean 'finish-later'?"),
    ("limit_s = 470", "limit_s = 0", "limit_s", "more than 0"),
    ("limit_s = 470", "limit_s = 30", "limit_s", "its limit is 30 s"),
    ("limit_s = 470", "limit_s = -5", "limit_s", "0 to 86400"),
    ("max_elevation_deg = 30, dur", "max_elevation_deg = 91, dur", "min_pass.max_elevation_deg", "0 to 90"),
    ("duration_s = 400", "duration_s = 40", "steps[2].when.before_los_s", "begins 30 s after AOS at the earliest, and wants 60 s before LOS, of 40 s"),
    ("duration_s = 400", "duration_s = 1e9", "min_pass.duration_s", "0 to 86400"),
    ("min_max_elevation_deg = 30", "min_max_elevation_deg = -1", "attach.min_max_elevation_deg", "0 to 90"),
    ("18:00-06:00", "18-6", "attach.hours_utc[0]", "18:00-06:00"),
    ("18:00-06:00", "18:00-24:00", "attach.hours_utc[0]", "two UTC times"),
    ("sunlit = true", "sunlit = 1", "attach.sunlit", "boolean"),
    ("every = 2", "every = 0", "attach.every", "Give 1 for every pass"),
    ("do = \"listen\"\nfor_s = 20.5", "do = \"lisen\"\nfor_s = 20.5", "steps[0].do", "Did you mean 'listen'? Known are listen, command"),
    ("do = \"listen\"\nfor_s = 20.5", "do = \"dance\"\nfor_s = 20.5", "steps[0].do", "'dance' is no step. Known are listen"),
    ("for_s = 20.5", "for_s = 0", "steps[0].for_s", "more than 0"),
    ("for_s = 20.5", "", "steps[0].for_s", "'for_s' is missing"),
    ("for_s = 20.5", "for_s = 20.5\ntimeout_s = 3", "steps[0].timeout_s", "a 'listen' has no 'timeout_s'"),
    ("until = { heard_within_s = 70 }", "until = { heard_within_s = 0 }", "steps[1].until.heard_within_s", "more than 0"),
    ("until = { heard_within_s = 70 }", "until = {}", "steps[1].until", "nothing is waited for"),
    ("until = { heard_within_s = 70 }", "", "steps[1].until", "'until' is missing"),
    ("timeout_s = 100", "", "steps[1].timeout_s", "'timeout_s' is missing"),
    ("timeout_s = 100", "timeout_s = 90000", "steps[1].timeout_s", "0 to 86400"),
    ("on_failure = \"skip\"", "on_failure = \"stop\"", "steps[1].on_failure", "`abort`, `skip`, `continue`"),
    ("command = \"GetImageChunk\"", "command = \"GetImageChunks\"", "steps[2].command", "Did you mean 'GetImageChunk'?"),
    ("command = \"GetImageChunk\"", "", "steps[2].command", "the name of a telecommand"),
    ("count = 8 }\npri", "count = 65 }\npri", "steps[2].arguments.count", "from 1 to 64"),
    ("first = 0, count = 8 }\npri", "first = 0, count = 8, x = 1 }\npri", "steps[2].arguments.x", "is no argument here"),
    ("priority = 9", "priority = 1.5", "steps[2].priority", "floating point"),
    ("attempts = 2", "attempts = 0", "steps[2].attempts", "1 or more"),
    ("gate = \"heard\"", "gate = \"herd\"", "steps[2].gate", "Did you mean 'heard'?"),
    ("limit_s = 60", "limit_s = 5", "steps[2].limit_s", "the step takes 12"),
    ("elevation_deg = 20", "elevation_deg = 95", "steps[2].when.elevation_deg", "0 to 90"),
    ("after_aos_s = 30", "after_aos_s = -30", "steps[2].when.after_aos_s", "0 to 86400"),
    ("before_los_s = 60", "before_los_s = 390", "steps[2].when.before_los_s", "wants 390 s before LOS, of 400 s"),
    ("before_los_s = 60", "before_los = 60", "steps[2].when.before_los", "Did you mean 'before_los_s'?"),
    ("heartbeat.temp", "heartbeat.tmp", "steps[2].when.telemetry[0].parameter", "Did you mean heartbeat.temp?"),
    ("op = \"<\"", "op = \"=\"", "steps[2].when.telemetry[0].op", "Write one of < <="),
    ("value = 40", "value = inf", "steps[2].when.telemetry[0].value", "Give a number"),
    ("max_age_s = 120", "max_age_s = 0", "steps[2].when.telemetry[0].max_age_s", "more than 0"),
    ("2026-11-23T00:00:00Z", "2026-11-21T00:00:00Z", "steps[3].slots[0].time", "it lies in the past"),
    ("\"2026-11-23T00:00:00Z\"", "2026-11-21T00:00:00Z", "steps[3].slots[0].time", "it lies in the past"),
    ("\"2026-11-23T00:00:00Z\"", "\"tomorrow\"", "steps[3].slots[0].time", "UTC time"),
    ("slots = [", "schedule = 1\nslots = [", "steps[3].schedule", "belongs to 'entries'"),
    ("slots = [", "entries = [", "steps[3].schedule", "the number of the schedule"),
    ("slots = [{ time = \"2026-11-23T00:00:00Z\", first = 0, count = 8 }]", "", "steps[3].slots", "there is no schedule"),
    ("approved_by =", "# ", "steps[4].approved_by", "Reset is critical, and nobody has approved it"),
    ("name = \"A. Verma\"", "name = \" \"", "steps[4].approved_by", "nobody's name"),
    ("digest = \"", "digest = \"x", "steps[4].approved_by.digest", "16 hex digits"),
    ("command = \"Reset\"", "command = \"SetTransmitter\"\narguments = { on = true }", "steps[4].approved_by", "approved something else"),
    ("2026-12-01", "2026-11-01", "steps[4].approved_by", "has expired"),
    ("2026-12-01T00:00:00Z", "soon", "steps[4].approved_by.expires_at", "RFC 3339"),
    ("command = \"Reset\"", "command = \"Reset\"\nattempts = 2", "steps[4].attempts", "must not be repeated"),
    ("at_most = 3", "", "steps[5].at_most", "a repeat has a bound"),
    ("at_most = 3", "at_most = 0", "steps[5].at_most", "a repeat has a bound"),
    ("at_most = 3", "at_most = 1000000", "steps[5].at_most", "Give 1 to 1000"),
    ("until = { heard_within_s = 5 }", "until = {}", "steps[5].until", "always holds"),
    ("for_s = 5\n", "for_s = 99999\n", "steps[5].steps[0].for_s", "0 to 86400"),
    ("do = \"download-image\"", "do = \"download-image\"\nfor_s = 3", "steps[6].for_s", "no fields of its own"),
    ("transmit = true", "transmit = false", "steps[2].do", "transmit = false"),
    ("transmit = true", "transmit = false", "steps[6].do", "'download-image' makes the station transmit"),
];

#[test]
fn each_field_wrong_once_is_told_with_line_field_and_remedy() {
    let good = good();
    let mut failures = Vec::new();
    for (found, put, place, words) in WRONG {
        assert_eq!(good.matches(found).count(), 1, "'{found}' is not there once");
        let checked = look(&good.replacen(found, put, 1));
        if checked.is_good() {
            failures.push(format!("{put} is taken"));
            continue;
        }
        let Some(told) = checked.findings.iter().find(|finding| finding.place == *place) else {
            failures.push(format!("{put}: not at {place}: {:#?}", checked.findings));
            continue;
        };
        let sentence = format!("{}. {}", told.problem, told.remedy);
        if !sentence.contains(words) || told.remedy.is_empty() {
            failures.push(format!("{put}: {sentence}"));
        }
        // The line is that of the change, or of what should hold what is missing.
        let begin = good[..good.find(found).unwrap()].matches('\n').count() + 1;
        let far = if place.rsplit('.').next().is_some_and(|field| put.contains(field)) { 1 } else { 3 };
        let elsewhere = (place.starts_with("steps") && *found == "transmit = true")
            || *place == "steps[4].approved_by"
            || found.starts_with("duration_s = 400");
        if !elsewhere && told.line.is_none_or(|line| begin.abs_diff(line) > far) {
            failures.push(format!("{put}: line {:?}, changed {begin}", told.line));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn lines_and_columns_are_those_of_the_field_in_both_forms() {
    let text = good().replace("at_most = 3", "at_most = 0");
    let toml = look(&text);
    let line = text.lines().position(|line| line == "at_most = 0").unwrap() + 1;
    assert_eq!((toml.findings[0].line, toml.findings[0].column), (Some(line), Some(1)));
    let text = as_json(&text);
    let json = look(&text);
    let line = text.lines().position(|line| line.contains("\"at_most\": 0")).unwrap() + 1;
    let column = text.lines().nth(line - 1).unwrap().find('"').unwrap() + 1;
    assert_eq!((json.findings[0].line, json.findings[0].column), (Some(line), Some(column)));
}

#[test]
fn what_is_no_plan_at_all_is_told_with_its_line() {
    for (text, line, words) in [
        ("name = \"x\"\nname = \"y\"\n", 2, "duplicate key"),
        ("name = \"x\"\nsatellite = \n", 2, "no TOML"),
        ("{\"name\": \"x\",\n \"satellite\": }", 2, "no JSON"),
        ("{\"name\": \"x\",\n \"satellite\": \"y\", \"steps\": []}\n}", 3, "follows the end"),
        ("{\"name\": \"x\",\n \"satelite\": \"y\"}", 2, "Did you mean 'satellite'?"),
        ("name = \"x\"\n", 1, "missing field `satellite`"),
        ("", 1, "missing field `name`"),
    ] {
        let checked = look(text);
        let told = &checked.findings[0];
        let sentence = format!("{}. {}", told.problem, told.remedy);
        assert!(sentence.contains(words), "{text}: {sentence}");
        assert_eq!(told.line, Some(line), "{text}: {sentence}");
    }
}

#[test]
fn a_plan_longer_than_its_pass_is_told_with_both_figures() {
    let text = "name = \"long\"\nsatellite = \"pixelsat-1\"\n[[steps]]\ndo = \"listen\"\nfor_s = 500\n";
    let told = |pass, text: &str| check_text(text, Form::Toml, &context(Some(pass))).findings;
    let findings = told((480, 30.0), text);
    assert_eq!(findings.len(), 1, "{findings:#?}");
    assert!(findings[0].problem.contains("takes 500 s at least, this pass lasts 480 s"), "{findings:#?}");
    assert_eq!(told((500, 30.0), text), []);
    let later = format!("at_los = \"finish-later\"\n{text}");
    assert!(told((480, 30.0), &later).iter().all(|finding| finding.severity == "warning"));
    let high = text.replace("500", "5\nwhen = { elevation_deg = 40 }");
    let findings = told((480, 30.0), &high);
    assert_eq!(findings[0].place, "steps[0].when.elevation_deg");
    assert!(findings[0].problem.contains("40° is wanted, this pass comes to 30°"), "{findings:#?}");
    let picky = text.replace("[[", "min_pass = { max_elevation_deg = 40, duration_s = 490 }\n[[");
    let places: Vec<_> = told((480, 30.0), &picky).into_iter().map(|finding| finding.place).collect();
    assert!(places.contains(&"min_pass.max_elevation_deg".to_owned()), "{places:?}");
    assert!(places.contains(&"min_pass.duration_s".to_owned()), "{places:?}");
}

#[test]
fn telecommands_take_their_airtime() {
    let text = |n| {
        format!(
            "name = \"pings\"\nsatellite = \"pixelsat-1\"\ntransmit = true\n[[steps]]\ndo = \"repeat-until\"\nat_most = \
             {n}\n[[steps.steps]]\ndo = \"command\"\ncommand = \"Ping\"\n"
        )
    };
    let context = context(Some((480, 30.0)));
    let one = LinkTiming::default();
    let exchange = mission::plan::need::exchange_us(&Telecommand::Ping, &one);
    assert!((2_000_000..3_000_000).contains(&exchange), "{exchange}");
    let fit = 480_000_000 / exchange;
    assert!(check_text(&text(fit), Form::Toml, &context).is_good());
    let checked = check_text(&text(fit + 1), Form::Toml, &context);
    assert!(!checked.is_good() && checked.findings[0].problem.contains("this pass lasts 480 s"));
}

#[test]
fn a_long_schedule_goes_in_parts_with_one_checksum() {
    let entries: Vec<String> = (0..19)
        .map(|i| format!("{{ time = 2026-11-23T00:00:{i:02}Z, script = {i}, argument = [0, 0, {i}] }}"))
        .collect();
    let text = |entries: &[String]| {
        format!(
            "name = \"upload\"\nsatellite = \"hermes\"\ntransmit = true\n[[steps]]\ndo = \"upload-schedule\"\nschedule = \
             3\nentries = [\n{}\n]\napproved_by = {{ name = \"x\" }}\n",
            entries.join(",\n")
        )
    };
    let checked = look(&text(&entries));
    assert!(checked.is_good(), "{:#?}", checked.findings);
    assert_eq!(checked.findings.len(), 1, "an approval of anything is worth a warning");
    let plan = checked.plan.unwrap();
    let Action::Send(send) = &plan.steps[0].action else { panic!() };
    let mut bytes = Vec::new();
    let mut checksums = Vec::new();
    for (part, telecommand) in (0..).zip(&send.telecommands) {
        let Telecommand::UploadSchedule(upload) = telecommand else { panic!() };
        assert_eq!((upload.schedule, upload.part, upload.parts), (3, part, 3));
        for entry in &upload.entries {
            bytes.extend_from_slice(&entry.time_ms.to_be_bytes());
            bytes.push(entry.script);
            bytes.extend(entry.argument.iter().flat_map(|value| value.to_be_bytes()));
        }
        checksums.push(upload.entries_crc32);
    }
    assert_eq!(bytes.len(), 19 * 21);
    assert_eq!(checksums, [protocol::crc32(&bytes); 3]);

    let mut wrong = entries;
    wrong[17] = wrong[17].replace("script = 17", "script = 256");
    let checked = look(&text(&wrong));
    assert_eq!(checked.findings[0].place, "steps[0].entries[17].script");
    assert_eq!(checked.findings[0].line, Some(8 + 17));
}

#[test]
fn every_template_passes_its_check() {
    for template in Template::ALL {
        let text = template.write("pixelsat-1", Some("A. \"V\" Verma"));
        let checked = check_text(&text, Form::of(&text), &context(Some((480, 60.0))));
        assert!(checked.is_good(), "{template:?}: {:#?}", checked.findings);
        assert_eq!(checked.findings, [], "{template:?}");
        let checked = look(&text);
        assert!(checked.is_good() && checked.findings.is_empty(), "{template:?}: {:#?}", checked.findings);
        let unsigned = look(&template.write("pixelsat-1", None));
        assert_eq!(unsigned.is_good(), !template.needs_approval(), "{template:?}");
    }
    let text = Template::SetClock.write("pixelsat-1", None);
    let told = &look(&text).findings[0];
    assert_eq!(told.place, "steps[1].steps[0].approved_by");
    assert!(told.remedy.contains("approved_by = { name"), "{}", told.remedy);
}

#[test]
fn hostile_texts_end_in_findings() {
    let deep = "[".repeat(10_000);
    let nested = |n: usize| {
        let mut step = "{\"do\": \"listen\", \"for_s\": 1}".to_owned();
        for _ in 0..n {
            step = format!(
                "{{\"do\": \"repeat-until\", \"at_most\": 1000, \"limit_s\": 1, \"steps\": [{step}]}}"
            );
        }
        format!("{{\"name\": \"x\", \"satellite\": \"y\", \"steps\": [{step}]}}")
    };
    let long = format!("name = \"{}\"", "x".repeat(300_000));
    for text in [&format!("{{\"name\": {deep}"), &format!("name = {deep}"), &nested(5), &nested(30), &long] {
        assert!(!look(text).is_good());
    }
    // Four deep is allowed; so many steps are not.
    let findings = look(&nested(4)).findings;
    assert!(findings.iter().any(|finding| finding.problem.contains("1000000000000 steps")), "{findings:#?}");
}
