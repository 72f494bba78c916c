//! docs/first-week.md as a newcomer goes through it: each command in its order, taken from the page, with the real program, a
//! twin behind a pseudo-terminal and a mail catcher; and what the page says is to be seen is seen.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::time::Duration;

use end_to_end::Client;
use end_to_end::binary::{gs_server, workspace};
use end_to_end::folder::free_address;
use end_to_end::guide::{Guide, Step, What, unseen};
use end_to_end::mail::MailCatcher;
use end_to_end::terminal::Terminals;
use end_to_end::wait::until;
use serde_json::json;

/// The schema before reports and what others heard: whatever the walk leaves in the archive fits into it.
const OLD_SCHEMA: usize = 6;

/// A pass takes half a minute here; the machine may be busy.
const LIMIT: Duration = Duration::from_secs(240);

struct Newcomer {
    terminals: Terminals,
    catcher: MailCatcher,
    client: Client,
    /// What the page names, and what it is here.
    replaced: Vec<(String, String)>,
    /// What the last command said.
    said: String,
}

impl Newcomer {
    /// The page's text with what is the reader's own.
    fn own(&self, text: &str) -> String {
        self.replaced.iter().fold(text.to_owned(), |text, (here, own)| text.replace(here, own))
    }

    fn does(&mut self, step: &Step) {
        let seen: Vec<String> = step.seen.iter().map(|line| self.own(line)).collect();
        match &step.what {
            What::Run(commands) => {
                let (well, said) = self.terminals.run(&self.own(commands));
                assert!(well, "{step}\n{said}");
                assert_eq!(unseen(&seen, &said), None, "{step}\n{said}");
                self.said = said;
            }
            What::Repeat(commands) => {
                let commands = self.own(commands);
                assert!(!seen.is_empty(), "{step}: repeated until when?");
                until(&step.to_string(), LIMIT, || {
                    let (_, said) = self.terminals.run(&commands);
                    unseen(&seen, &said).is_none().then_some(())
                });
            }
            // Its place is taken by the test's own catcher, which shows what came.
            What::Window(name, command) if name == "mail" => {
                assert!(self.own(command).contains(&self.catcher.address.to_string()), "{step}");
            }
            What::Window(name, command) => {
                let command = self.own(command);
                self.terminals.open(name, &command);
                until(&step.to_string(), LIMIT, || {
                    assert!(self.terminals.stays(name), "{step}\n{}", self.terminals.shown(name));
                    unseen(&seen, &self.terminals.shown(name)).is_none().then_some(())
                });
            }
            What::Close(name) => self.terminals.close(name),
            What::Browser(words) => self.browses(words),
            What::Look(name) => {
                assert_eq!(name, "mail", "{step}");
                let (mail, _) = until(&step.to_string(), LIMIT, || self.catcher.mails().pop());
                assert_eq!(unseen(&seen, &mail), None, "{step}\n{mail}");
            }
        }
    }

    /// As the pages `/welcome` and `/login` do it.
    fn browses(&mut self, words: &str) {
        let (name, deed) = words.split_once(' ').expect("somebody does something");
        let password = format!("{name} has a long password");
        let (path, body) = match deed {
            "begins" => {
                let shown = self.terminals.shown("server");
                let text =
                    if shown.contains("/welcome#code=") && name == "ana" { &shown } else { &self.said };
                let code = text.split("/welcome#code=").nth(1).expect("a link").split_whitespace().next();
                let body = json!({"code": code.expect("a code"), "name": (name == "ana").then_some(name), "password": password});
                ("/api/v1/welcome", body)
            }
            "logs in" => ("/api/v1/session", json!({"name": name, "password": password})),
            other => panic!("what is '{other}'?"),
        };
        let headers = [("content-type", "application/json")];
        let answer = self.client.ask("POST", path, &headers, body.to_string().as_bytes()).expect("an answer");
        assert_eq!(answer.status, 200, "{words}: {}", answer.text());
        let cookie = answer.header("set-cookie").expect("a cookie").split(';').next().unwrap_or_default();
        let session =
            self.client.ask("GET", "/api/v1/session", &[("cookie", cookie)], b"").expect("an answer");
        assert!(session.text().contains(name), "{}", session.text());
        let page = self.client.ask("GET", "/", &[("cookie", cookie)], b"").expect("an answer");
        assert_eq!(page.status, 200);
    }
}

#[test]
fn a_newcomer_gets_through_the_first_week_by_the_page_alone() {
    let home = tempfile::Builder::new().prefix("gs-guide-").tempdir().expect("a temporary folder");
    let page = workspace().join("docs/first-week.md");
    let guide = Guide::parse(&std::fs::read_to_string(page).expect("the page"));
    let (catcher, address) = (MailCatcher::start(), free_address());
    let own = |here: &str| match here {
        "/path/to/gs-server" => gs_server().display().to_string(),
        "127.0.0.1:8700" => address.to_string(),
        "127.0.0.1:1025" => catcher.address.to_string(),
        other => panic!("the page lets '{other}' be replaced, and nobody knows by what"),
    };
    let replaced: Vec<_> = guide.replaced.iter().map(|here| (here.clone(), own(here))).collect();
    assert_eq!(replaced.len(), 3);
    let mut newcomer = Newcomer {
        terminals: Terminals::new(home.path()),
        catcher,
        client: Client { address, token: String::new() },
        replaced,
        said: String::new(),
    };
    newcomer.terminals.environment.push(("GS_LISTEN", address.to_string()));
    // The first block makes the folder that each terminal begins in.
    let (first, rest) = guide.steps.split_first().expect("something to do");
    newcomer.does(first);
    newcomer.terminals.prelude = guide.prelude.clone();
    assert!(rest.len() > 25, "{} steps", rest.len());
    // Reader and test have one program; so that the upgrade is one, the archive is made an older program's before it.
    let archive = home.path().join("ground/ground-data/ground.sqlite3");
    let newest = migrations::newest_sqlite();
    let (mut upgraded, mut migrated) = (false, false);
    for step in rest {
        eprintln!("{step}");
        let is_new_program = matches!(&step.what, What::Run(commands) if commands.starts_with("install "));
        if is_new_program {
            migrations::tables::age(&archive, OLD_SCHEMA).expect("an older archive");
            assert_eq!(migrations::tables::schema(&archive).expect("a schema"), OLD_SCHEMA as i64);
        }
        newcomer.does(step);
        if is_new_program {
            upgraded = true;
        } else if upgraded && matches!(&step.what, What::Window(name, _) if name == "server") {
            let says = format!("the archive is brought from schema {OLD_SCHEMA} to {newest}");
            assert!(newcomer.terminals.shown("server").contains(&says), "{says}");
            assert_eq!(migrations::tables::schema(&archive).expect("a schema"), newest);
            upgraded = false;
        } else if matches!(&step.what, What::Run(commands) if commands.contains("after-upgrade.tar")) {
            assert!(newcomer.said.contains(&format!("schema {newest}")), "{}", newcomer.said);
            migrated = true;
        }
    }
    assert!(migrated, "the page has no upgrade any more");
}
