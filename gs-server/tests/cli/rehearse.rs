//! `rehearse`.

use std::fs;
use std::path::Path;

use satellite::Orbit;
use tle::UtcInstant;
use tle::formats::{self, Form};

use super::{json, run};

/// 2027-06-01T04:05:06.789Z.
const ZERO: UtcInstant = UtcInstant::from_unix_us(1_811_822_706_789_000);
const LAUSANNE: &str = "Lausanne=46.5191,6.5668,410";

/// Elements of an object of this name, and a plan from a template.
fn files(folder: &Path, name: &str, template: &str) -> (String, String) {
    let [elements, plan] = ["gp.json", "plan.toml"].map(|file| folder.join(file).display().to_string());
    let set = Orbit::fictional(3, ZERO).named(name).elements().clone();
    fs::write(&elements, formats::write(Form::OmmJson, &[set]).unwrap()).unwrap();
    fs::write(&plan, run(["plan", "new", "--template", template, "--approved-by", "A. Verma"]).1).unwrap();
    (plan, elements)
}

fn rehearse(plan: &str, elements: &str, more: &[&str]) -> (i32, String, String) {
    let usual =
        ["rehearse", plan, "--elements", elements, "--station", LAUSANNE, "--pass", "2027-06-01T05:00:00Z"];
    run(usual.iter().chain(more))
}

#[test]
fn a_plan_is_rehearsed_and_the_same_seeds_give_the_same_answer() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, elements) = files(folder.path(), "pixelsat-1", "download");
    let (code, out, error) = rehearse(&plan, &elements, &["--runs", "12"]);
    assert_eq!((code, error.as_str()), (0, ""), "{out}");
    for part in
        ["plan download for pixelsat-1, pass from 2027-06-01T", "12 runs, seeds 1 to 12", "chunks home"]
    {
        assert!(out.contains(part), "{part}: {out}");
    }
    let ask = |seed: &str| rehearse(&plan, &elements, &["--runs", "12", "--seed", seed, "--json"]);
    let (code, out, error) = ask("1");
    assert_eq!((code, error.as_str()), (0, ""));
    assert_eq!(out, ask("1").1);
    let (answer, other) = (json(&out), json(&ask("13").1));
    assert_ne!(answer["outcomes"], other["outcomes"]);
    assert_eq!((&answer["ok"], &answer["runs"], &answer["begun"]), (&true.into(), &12.into(), &12.into()));
    let chunks = &answer["figures"]["chunks_home"];
    let figure = |name: &str| chunks[name].as_f64().unwrap();
    assert!(figure("p10") > 0.0 && figure("p10") <= figure("p50") && figure("p50") <= figure("p90"));
    let outcomes = answer["outcomes"].as_array().unwrap();
    assert_eq!(outcomes.len(), 12);
    assert!(outcomes.iter().all(|run| run["commands_outside"] == 0 && run["chunks_home"].as_f64().is_some()));
}

#[test]
fn what_cannot_fit_is_told_with_its_line_and_makes_the_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, elements) = files(folder.path(), "pixelsat-1", "listen");
    let text = "name = \"long\"\nsatellite = \"pixelsat-1\"\n[[steps]]\ndo = \"listen\"\nfor_s = 1500\n";
    fs::write(&plan, text).unwrap();
    let (code, out, error) = rehearse(&plan, &elements, &["--runs", "2"]);
    assert_eq!(code, 1, "{out}{error}");
    assert!(out.contains(&format!("{plan}:3:3: error at steps: the plan takes 1500 s at least")), "{out}");
    assert!(out.contains("warning at steps[0]: 'listen' was done in 0 of 2 runs"), "{out}");
}

#[test]
fn what_the_station_would_not_take_is_not_rehearsed() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, elements) = files(folder.path(), "pixelsat-1", "listen");
    fs::write(&plan, run(["plan", "new", "--template", "set-clock"]).1).unwrap();
    let (code, out, error) = rehearse(&plan, &elements, &[]);
    assert_eq!(code, 2, "{error}");
    assert!(out.contains("SetTimestamp is critical, and nobody has approved it"), "{out}");
    assert!(error.contains("was not rehearsed"), "{error}");
    let (code, out, _) = rehearse(&plan, &elements, &["--json"]);
    assert_eq!((code, &json(&out)["ok"]), (2, &false.into()));

    let past = "name = \"past\"\nsatellite = \"pixelsat-1\"\ntransmit = true\n[[steps]]\ndo = \"upload-schedule\"\n\
                slots = [{ time = \"2027-06-01T00:00:00Z\", first = 0, count = 4 }]\n";
    fs::write(&plan, past).unwrap();
    let (code, out, error) = rehearse(&plan, &elements, &[]);
    assert_eq!(code, 2, "{out}{error}");
    assert!(out.contains("error at steps[0].slots[0].time: it lies in the past"), "{out}");
}

#[test]
fn elements_are_found_by_the_name_of_the_satellite_or_told_which() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, elements) = files(folder.path(), "pixelsat-1", "status");
    let sets = [("HERMES", 3), ("OTHER", 4)]
        .map(|(name, seed)| Orbit::fictional(seed, ZERO).named(name).elements().clone());
    fs::write(&elements, formats::write(Form::OmmJson, &sets).unwrap()).unwrap();
    let (code, _, error) = rehearse(&plan, &elements, &["--runs", "1"]);
    assert_eq!(code, 1);
    assert!(error.contains("pixelsat-1") && error.contains("--satellite"), "{error}");
    let (code, out, error) = rehearse(&plan, &elements, &["--runs", "1", "--satellite", "hermes"]);
    assert_eq!((code, error.as_str()), (0, ""), "{out}");
}

#[test]
fn a_configuration_says_how_the_satellite_is_commanded() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, elements) = files(folder.path(), "pixelsat-1", "status");
    let config = folder.path().join("station.toml").display().to_string();
    fs::write(&config, run(["config", "example"]).1).unwrap();
    let (code, out, error) = rehearse(&plan, &elements, &["--runs", "2", "--config", &config]);
    assert_eq!((code, error.as_str()), (0, ""), "{out}");
    fs::write(&plan, run(["plan", "new", "--satellite", "hermes"]).1).unwrap();
    let (code, _, error) = rehearse(&plan, &elements, &["--runs", "2", "--config", &config]);
    assert_eq!(code, 2);
    assert!(error.contains("the configuration has no link to 'hermes'"), "{error}");
}

#[test]
fn arguments_that_make_no_sense_are_2() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, elements) = files(folder.path(), "pixelsat-1", "status");
    for wrong in [
        &["--runs", "0"][..],
        &["--runs", "1000000"],
        &["--image-bytes", "9-3"],
        &["--image-bytes", "many"],
        &["--seed", "18446744073709551615"],
        &["--pass", "yesterday"],
    ] {
        let (code, out, error) = rehearse(&plan, &elements, wrong);
        assert_eq!((code, out.as_str()), (2, ""), "{wrong:?}: {error}");
    }
    assert_eq!(run(["rehearse", &plan]).0, 2, "of which elements?");
    assert_eq!(run(["rehearse", &plan, "--elements", &elements]).0, 2, "over which station?");
    assert_eq!(run(["rehearse", "none.toml", "--elements", &elements, "--station", LAUSANNE]).0, 1);
    fs::write(&elements, "<html>").unwrap();
    assert_eq!(rehearse(&plan, &elements, &[]).0, 1);
}
