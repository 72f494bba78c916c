//! The help of every verb, as it is printed on a terminal of 100 columns.

use clap::CommandFactory as _;
use gs_server::cli::Cli;

use super::run;

fn pages(command: &mut clap::Command, path: &str, out: &mut Vec<(String, String)>) {
    let path = format!("{path} {}", command.get_name()).trim().to_owned();
    out.push((path.replace(' ', "-"), command.render_long_help().to_string()));
    for verb in command.get_subcommands_mut().filter(|verb| verb.get_name() != "help") {
        pages(verb, &path, out);
    }
}

#[test]
fn every_verb_tells_what_it_does() {
    let mut command = Cli::command().term_width(100);
    command.build();
    let mut all = Vec::new();
    pages(&mut command, "", &mut all);
    for (name, help) in &all {
        assert!(help.lines().all(|line| line.chars().count() <= 104), "{name} is too wide:\n{help}");
        insta::with_settings!({ omit_expression => true }, { insta::assert_snapshot!(name.as_str(), help) });
    }
    let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        [
            "gs-server",
            "gs-server-serve",
            "gs-server-config",
            "gs-server-config-check",
            "gs-server-config-example",
            "gs-server-demo",
            "gs-server-twin",
            "gs-server-twin-serve",
            "gs-server-decode",
            "gs-server-passes",
            "gs-server-look",
            "gs-server-openapi",
            "gs-server-radio",
            "gs-server-radio-list",
            "gs-server-radio-probe",
            "gs-server-radio-configure",
            "gs-server-radio-monitor",
            "gs-server-elements",
            "gs-server-elements-add",
            "gs-server-elements-list",
            "gs-server-elements-fetch",
            "gs-server-elements-check",
            "gs-server-elements-prelaunch",
            "gs-server-plan",
            "gs-server-plan-new",
            "gs-server-plan-check",
            "gs-server-plan-add",
            "gs-server-plan-list",
            "gs-server-plan-arm",
            "gs-server-plan-disarm",
            "gs-server-plan-attach",
            "gs-server-plan-detach",
            "gs-server-plan-withdraw",
            "gs-server-rehearse",
            "gs-server-downlink",
            "gs-server-downlink-plan",
            "gs-server-fit",
            "gs-server-schedule",
            "gs-server-runs",
            "gs-server-hold",
            "gs-server-release",
            "gs-server-alert",
            "gs-server-alert-list",
            "gs-server-alert-acknowledge",
            "gs-server-alert-shelve",
            "gs-server-alert-unshelve",
            "gs-server-alert-assign",
            "gs-server-alert-targets",
            "gs-server-alert-test",
            "gs-server-forward",
            "gs-server-forward-targets",
            "gs-server-forward-list",
            "gs-server-forward-show",
            "gs-server-forward-pause",
            "gs-server-forward-resume",
            "gs-server-forward-retry",
            "gs-server-report",
            "gs-server-report-pass",
            "gs-server-report-handover",
            "gs-server-report-month",
            "gs-server-rotator",
            "gs-server-rotator-probe",
            "gs-server-rotator-point",
            "gs-server-rotator-park",
            "gs-server-rotator-stop",
            "gs-server-rig",
            "gs-server-rig-probe",
            "gs-server-rig-tune",
            "gs-server-key",
            "gs-server-key-new",
            "gs-server-key-list",
            "gs-server-key-confirm",
            "gs-server-audit",
            "gs-server-audit-list",
            "gs-server-audit-verify",
            "gs-server-doctor",
            "gs-server-backup",
            "gs-server-backup-verify",
            "gs-server-restore",
            "gs-server-user",
            "gs-server-user-add",
            "gs-server-user-list",
            "gs-server-user-link",
            "gs-server-user-change",
            "gs-server-token",
            "gs-server-token-new",
            "gs-server-token-list",
            "gs-server-token-revoke",
            "gs-server-approvals",
            "gs-server-approve",
            "gs-server-refuse",
            "gs-server-ears",
            "gs-server-import",
            "gs-server-export",
            "gs-server-redecode",
        ]
    );
}

#[test]
fn wrong_usage_is_2_and_no_verb_shows_the_help() {
    for arguments in
        [&["dance"][..], &["decode", "--format", "morse"], &["serve"], &["twin", "serve", "--journal", "x"]]
    {
        let (code, out, error) = run(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{error}");
        assert!(error.contains("--help"), "{error}");
    }
    let (code, _, error) = run::<&str>([]);
    assert_eq!(code, 2);
    assert!(error.contains("demo"), "{error}");
    let (code, out, _) = run(["--version"]);
    assert_eq!((code, out.starts_with("gs-server ")), (0, true));
}
