//! `plan new` and `plan check`.

use std::fs;

use super::{json, run};

#[test]
fn a_template_is_printed_and_passes_its_check() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plan.toml").display().to_string();
    for template in ["listen", "status", "picture", "download", "set-clock"] {
        let (code, text, error) = run([
            "plan",
            "new",
            "--template",
            template,
            "--approved-by",
            "A. Verma",
            "--satellite",
            "hermes",
        ]);
        assert_eq!((code, error.as_str()), (0, ""));
        fs::write(&file, &text).unwrap();
        let (code, out, error) = run(["plan", "check", &file]);
        assert_eq!((code, error.as_str()), (0, ""), "{out}");
        assert!(out.contains(&format!("plan {template} for hermes is good")), "{out}");
        let (code, out, _) =
            run(["plan", "check", &file, "--pass", "600", "--max-elevation", "50", "--json"]);
        let verdict = json(&out);
        assert_eq!((code, &verdict["ok"], &verdict["findings"]), (0, &true.into(), &serde_json::json!([])));
        assert!(verdict["least_s"].as_f64().unwrap() < 600.0);
    }
    let (code, text, error) = run(["plan", "new", "--template", "set-clock"]);
    assert_eq!(code, 0);
    assert!(error.contains("--approved-by"), "{error}");
    fs::write(&file, text).unwrap();
    let (code, out, error) = run(["plan", "check", &file]);
    assert_eq!(code, 2, "{error}");
    assert!(out.contains("SetTimestamp is critical, and nobody has approved it"), "{out}");
}

#[test]
fn what_is_wrong_has_line_field_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("plan.toml").display().to_string();
    let text = "name = \"long\"\nsatellite = \"pixelsat-1\"\n[[steps]]\ndo = \"listen\"\nfor_s = 500\n";
    fs::write(&file, text).unwrap();
    let (code, out, error) = run(["plan", "check", &file, "--pass", "480", "--max-elevation", "30"]);
    assert_eq!(code, 2);
    assert!(
        out.starts_with(&format!(
            "{file}:3:3: error at steps: the plan takes 500 s at least, this pass lasts 480 s. "
        )),
        "{out}"
    );
    assert!(error.contains("1 error, the plan is not taken"), "{error}");

    fs::write(&file, text.replace("listen", "listn")).unwrap();
    let (code, out, _) = run(["plan", "check", &file]);
    assert_eq!(code, 2);
    assert!(
        out.contains(&format!("{file}:4:1: error at steps[0].do: 'listn' is no step. Did you mean")),
        "{out}"
    );
    let (code, out, _) = run(["plan", "check", &file, "--json"]);
    let verdict = json(&out);
    let found = &verdict["findings"][0];
    assert_eq!((code, &verdict["ok"], &verdict["name"]), (2, &false.into(), &serde_json::Value::Null));
    assert_eq!(
        (&found["line"], &found["column"], &found["place"]),
        (&4.into(), &1.into(), &"steps[0].do".into())
    );

    let (code, _, error) = run(["plan", "check", &folder.path().join("none").display().to_string()]);
    assert_eq!(code, 1, "{error}");
    assert_eq!(run(["plan", "check", &file, "--pass", "0"]).0, 2);
    assert_eq!(run(["plan", "check", &file, "--max-elevation", "30"]).0, 2, "of which pass?");
}

#[test]
fn a_configuration_says_which_satellites_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let (file, config) = (folder.path().join("plan.toml"), folder.path().join("station.toml"));
    fs::write(&config, run(["config", "example"]).1).unwrap();
    let [file, config] = [file, config].map(|path| path.display().to_string());
    for (satellite, code) in [("pixelsat-1", 0), ("hermes", 2)] {
        fs::write(&file, run(["plan", "new", "--satellite", satellite]).1).unwrap();
        let (found, out, error) = run(["plan", "check", &file, "--config", &config]);
        assert_eq!(found, code, "{out}{error}");
        assert_eq!(out.contains("the configuration has no link to 'hermes'"), code == 2, "{out}");
    }
}
