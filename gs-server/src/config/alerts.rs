//! `[alerts]`: what is an alert, and who is told.

use std::collections::BTreeMap;
use std::path::PathBuf;

use mission::Level;
use mission::alert::{AlertKind, Escalation, Policy, QuietHours, Rule, TargetPolicy};
use mission::record::EventKind;
use reqwest::Url;
use serde::Deserialize;

use super::{ConfigError, is_loopback};

/// `[alerts]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct AlertsSection {
    /// Stretches of each day, UTC, in which only critical and severe alerts are sent at once: `["21:00-05:30"]`.
    pub quiet_hours: Vec<String>,
    /// Targets that are told at first. Default: all that no escalation names.
    pub notify: Option<Vec<String>>,
    /// Who is told while nobody acknowledges, step by step. Default: nobody.
    pub escalate: Vec<EscalationSection>,
    /// A change that is not for the worse is told so many minutes after the last message at the earliest. Default 10.
    pub settle_min: Option<u32>,
    /// Rules; those that are built in stand before them.
    pub rules: Vec<RuleSection>,
    /// Where messages go. Default: nowhere; alerts are kept and shown all the same.
    pub targets: Vec<TargetSection>,
}

/// A step of escalation.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EscalationSection {
    /// After so many minutes without an acknowledgement, 1 to 10080.
    pub after_min: u32,
    /// Names of targets.
    pub to: Vec<String>,
}

/// `[[alerts.rules]]`: changes the built-in rule of a kind, or adds one for a subject.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RuleSection {
    /// What is watched.
    pub kind: String,
    /// Its name. Default: the kind (which changes the built-in rule), with the subject when there is one.
    #[serde(default)]
    pub name: Option<String>,
    /// Only this subject, as alerts show it.
    #[serde(default)]
    pub subject: Option<String>,
    /// False: no alert of this kind and subject. Default true.
    #[serde(default)]
    pub enabled: Option<bool>,
    /// The level of its alerts. Default: as grave as what is seen.
    #[serde(default)]
    pub level: Option<String>,
    /// What is less grave is no alert. Default `watch`, of events `warning`.
    #[serde(default)]
    pub min_level: Option<String>,
    /// It must hold so many seconds before it counts.
    #[serde(default)]
    pub on_delay_s: Option<u32>,
    /// It must be gone so many seconds before it counts as gone.
    #[serde(default)]
    pub off_delay_s: Option<u32>,
    /// What is over stays until somebody acknowledges. Default true.
    #[serde(default)]
    pub latch: Option<bool>,
    /// Targets that are told at first. Default: as in `[alerts]`.
    #[serde(default)]
    pub notify: Option<Vec<String>>,
    /// Who is told later. Default: as in `[alerts]`.
    #[serde(default)]
    pub escalate: Option<Vec<EscalationSection>>,
    /// Kind `event`: which events. Default `satellite-error` and `chunk-conflict`.
    #[serde(default)]
    pub events: Option<Vec<String>>,
    /// Kind `beacon`: heartbeat periods in view without a frame. Default 2.
    #[serde(default)]
    pub intervals: Option<u32>,
    /// Kind `silent`: passes in a row without a frame. Default 2.
    #[serde(default)]
    pub passes: Option<u32>,
    /// Kinds `beacon` and `silent`: lower passes say nothing, degrees. Default 10.
    #[serde(default)]
    pub min_elevation_deg: Option<f64>,
    /// Kind `disk`: free space, percent. Default `{ watch = 10, warning = 5, critical = 2 }`.
    #[serde(default)]
    pub free_percent: Option<BTreeMap<String, f64>>,
}

/// How a target is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TargetKind {
    /// SMTP.
    Email,
    /// A POST of JSON, signed.
    Webhook,
    /// A room of a Matrix server.
    Matrix,
    /// An incoming webhook of Slack, or of what speaks its form (Mattermost).
    Slack,
    /// A webhook of Discord.
    Discord,
}

/// What protects the way to the mail server.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum TransportSecurity {
    /// Begins in the clear and must change to TLS before anything is said.
    #[default]
    Starttls,
    /// TLS from the first byte.
    Tls,
    /// Nothing; only to this machine itself.
    None,
}

/// `[[alerts.targets]]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetSection {
    /// Its name: 1 to 32 of a-z, 0-9, `-`, `_`.
    pub name: String,
    /// How it is reached.
    pub kind: TargetKind,
    /// Nothing below this is sent to it. Default `watch`.
    #[serde(default)]
    pub min_level: Option<String>,
    /// Quiet hours hold for it. Default true.
    #[serde(default)]
    pub quiet: Option<bool>,
    /// Webhook: where to. Matrix: the homeserver. (Slack and Discord: their address is a secret.)
    #[serde(default)]
    pub url: Option<String>,
    /// E-mail: host and port of the mail server.
    #[serde(default)]
    pub server: Option<String>,
    /// E-mail: how it is protected. Default `starttls`.
    #[serde(default)]
    pub security: TransportSecurity,
    /// E-mail: the sender.
    #[serde(default)]
    pub from: Option<String>,
    /// E-mail: the receivers.
    #[serde(default)]
    pub to: Vec<String>,
    /// E-mail: the account. Default: none, no login.
    #[serde(default)]
    pub user: Option<String>,
    /// Matrix: the room's id, `!…:server`.
    #[serde(default)]
    pub room: Option<String>,
    /// A file of mode 0600 with the secret: e-mail: the password; webhook: the key of the signature; Matrix: the access
    /// token; Slack and Discord: the webhook's address.
    #[serde(default)]
    pub secret_file: Option<PathBuf>,
    /// The variable of the environment that holds it instead.
    #[serde(default)]
    pub secret_env: Option<String>,
}

type Checked<T = ()> = Result<T, ConfigError>;

fn fail<T>(key: impl Into<String>, problem: impl Into<String>, remedy: &str) -> Checked<T> {
    Err(ConfigError::value(key, problem, remedy))
}

fn level(key: &str, word: Option<&String>) -> Checked<Option<Level>> {
    let Some(word) = word else { return Ok(None) };
    match word.parse::<Level>() {
        Ok(level) if level > Level::Normal => Ok(Some(level)),
        _ => fail(key, format!("'{word}'"), "Give watch, warning, distress, critical or severe."),
    }
}

impl AlertsSection {
    /// Whether the values are possible. Reads no secret.
    ///
    /// # Errors
    /// [`ConfigError`] with the key, what was found and what to do.
    pub fn check(&self) -> Checked {
        self.policy().map(drop)
    }

    /// What the machine goes by.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn policy(&self) -> Checked<Policy> {
        let mut policy = Policy::default();
        for (at, hours) in self.quiet_hours.iter().enumerate() {
            let remedy = "Give times of day in UTC.";
            let hours: QuietHours = hours.parse().map_err(|error: mission::alert::QuietHoursError| {
                ConfigError::value(format!("alerts.quiet_hours[{at}]"), error.to_string(), remedy)
            })?;
            policy.quiet_hours.push(hours);
        }
        for (at, target) in self.targets.iter().enumerate() {
            let key = format!("alerts.targets[{at}]");
            target.check(&key)?;
            if policy.target(&target.name).is_some() {
                return fail(
                    format!("{key}.name"),
                    format!("'{}' is there twice", target.name),
                    "Names are unique.",
                );
            }
            let min_level = level(&format!("{key}.min_level"), target.min_level.as_ref())?;
            policy.targets.push(TargetPolicy {
                name: target.name.clone(),
                min_level: min_level.unwrap_or(Level::Watch),
                quiet: target.quiet.unwrap_or(true),
            });
        }
        policy.escalate = self.steps("alerts.escalate", &self.escalate)?;
        policy.notify = match &self.notify {
            Some(names) => self.names("alerts.notify", names)?,
            None => {
                let rules = self.rules.iter().filter_map(|rule| rule.escalate.as_ref()).flatten();
                let later: Vec<&String> =
                    self.escalate.iter().chain(rules).flat_map(|step| &step.to).collect();
                let names = self.targets.iter().map(|target| &target.name);
                names.filter(|name| !later.contains(name)).cloned().collect()
            }
        };
        if let Some(minutes) = self.settle_min {
            if !(1..=1440).contains(&minutes) {
                return fail(
                    "alerts.settle_min",
                    format!("{minutes}"),
                    "Give 1 to 1440 minutes; 10 is plenty.",
                );
            }
            policy.settle_s = minutes * 60;
        }
        let mut given = Vec::new();
        for (at, section) in self.rules.iter().enumerate() {
            let key = format!("alerts.rules[{at}]");
            let rule = self.rule(&key, section, &mut policy)?;
            if given.contains(&rule.name) {
                let problem = format!("'{}' is there twice", rule.name);
                return fail(
                    format!("{key}.name"),
                    problem,
                    "Put it into one rule, or give one a name of its own.",
                );
            }
            given.push(rule.name.clone());
            match policy.rules.iter_mut().find(|other| other.name == rule.name) {
                Some(other) => *other = rule,
                None => policy.rules.push(rule),
            }
        }
        Ok(policy)
    }

    fn rule(&self, key: &str, section: &RuleSection, policy: &mut Policy) -> Checked<Rule> {
        let kind: AlertKind = match section.kind.parse() {
            Ok(kind) => kind,
            Err(_) => {
                let known = AlertKind::ALL.map(AlertKind::name).join(", ");
                return fail(
                    format!("{key}.kind"),
                    format!("'{}'", section.kind),
                    &format!("Give one of {known}."),
                );
            }
        };
        let mut rule = Rule::built_in(kind);
        rule.name = match (&section.name, &section.subject) {
            (Some(name), _) => name.clone(),
            (None, None) => kind.name().to_owned(),
            (None, Some(subject)) => format!("{kind} {subject}"),
        };
        let built_in_of_another =
            AlertKind::ALL.iter().any(|other| *other != kind && other.name() == rule.name);
        if rule.name.trim().is_empty() || rule.name.chars().count() > 100 || built_in_of_another {
            return fail(
                format!("{key}.name"),
                format!("'{}'", rule.name.chars().take(100).collect::<String>()),
                "Give 1 to 100 characters, and not the name of another kind.",
            );
        }
        rule.subject.clone_from(&section.subject);
        rule.enabled = section.enabled.unwrap_or(true);
        rule.level = level(&format!("{key}.level"), section.level.as_ref())?;
        rule.min_level =
            level(&format!("{key}.min_level"), section.min_level.as_ref())?.unwrap_or(rule.min_level);
        for (name, given, into) in [
            ("on_delay_s", section.on_delay_s, &mut rule.on_delay_s),
            ("off_delay_s", section.off_delay_s, &mut rule.off_delay_s),
        ] {
            let Some(seconds) = given else { continue };
            if seconds > 86_400 {
                return fail(format!("{key}.{name}"), format!("{seconds}"), "Give 0 to 86400 seconds.");
            }
            *into = seconds;
        }
        rule.latch = section.latch.unwrap_or(true);
        rule.notify =
            section.notify.as_ref().map(|names| self.names(&format!("{key}.notify"), names)).transpose()?;
        rule.escalate = section
            .escalate
            .as_ref()
            .map(|steps| self.steps(&format!("{key}.escalate"), steps))
            .transpose()?;
        if let Some(words) = &section.events {
            own(key, "events", kind, &[AlertKind::Event])?;
            rule.events = words.iter().map(|word| event(key, word)).collect::<Checked<_>>()?;
        }
        thresholds(key, section, kind, policy)?;
        Ok(rule)
    }

    fn names(&self, key: &str, names: &[String]) -> Checked<Vec<String>> {
        for name in names {
            if !self.targets.iter().any(|target| target.name == *name) {
                return fail(
                    key,
                    format!("'{name}' is no target"),
                    "Give names of [[alerts.targets]] sections.",
                );
            }
        }
        Ok(names.to_vec())
    }

    fn steps(&self, key: &str, steps: &[EscalationSection]) -> Checked<Vec<Escalation>> {
        let mut before = 0;
        let mut all = Vec::new();
        for (at, step) in steps.iter().enumerate() {
            let key = format!("{key}[{at}]");
            if step.after_min <= before || step.after_min > 10_080 {
                let problem = format!("{} minutes", step.after_min);
                return fail(
                    format!("{key}.after_min"),
                    problem,
                    "Give 1 to 10080, each later than the one before.",
                );
            }
            before = step.after_min;
            let to = self.names(&format!("{key}.to"), &step.to)?;
            all.push(Escalation { after_min: step.after_min, to });
        }
        Ok(all)
    }
}

fn event(key: &str, word: &str) -> Checked<EventKind> {
    let found = EventKind::ALL.into_iter().find(|kind| kind.name() == word && *kind != EventKind::Alert);
    let Some(kind) = found else {
        let known: Vec<&str> =
            EventKind::ALL.iter().map(|kind| kind.name()).filter(|name| *name != "alert").collect();
        return fail(
            format!("{key}.events"),
            format!("'{word}'"),
            &format!("Give some of {}.", known.join(", ")),
        );
    };
    Ok(kind)
}

/// A key that only some kinds have.
fn own(key: &str, name: &str, kind: AlertKind, kinds: &[AlertKind]) -> Checked {
    if kinds.contains(&kind) {
        return Ok(());
    }
    let names: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
    fail(
        format!("{key}.{name}"),
        format!("kind '{kind}' has no such key"),
        &format!("Remove it; it belongs to {}.", names.join(" and ")),
    )
}

fn thresholds(key: &str, section: &RuleSection, kind: AlertKind, policy: &mut Policy) -> Checked {
    let into = &mut policy.thresholds;
    let mut any = false;
    for (name, given, kinds, into) in [
        ("intervals", section.intervals, AlertKind::Beacon, &mut into.beacon_intervals),
        ("passes", section.passes, AlertKind::Silent, &mut into.silent_passes),
    ] {
        let Some(count) = given else { continue };
        own(key, name, kind, &[kinds])?;
        if !(1..=100).contains(&count) {
            return fail(format!("{key}.{name}"), format!("{count}"), "Give 1 to 100.");
        }
        (*into, any) = (count, true);
    }
    if let Some(degrees) = section.min_elevation_deg {
        own(key, "min_elevation_deg", kind, &[AlertKind::Beacon, AlertKind::Silent])?;
        if !(0.0..=80.0).contains(&degrees) {
            return fail(format!("{key}.min_elevation_deg"), format!("{degrees}"), "Give 0 to 80 degrees.");
        }
        (into.min_elevation_deg, any) = (degrees, true);
    }
    if let Some(free) = &section.free_percent {
        own(key, "free_percent", kind, &[AlertKind::Disk])?;
        let remedy = "Give { watch = 10, warning = 5, critical = 2 }: percent, falling.";
        for (at, word) in ["watch", "warning", "critical"].into_iter().enumerate() {
            into.disk_free_percent[at] = free.get(word).copied().unwrap_or(into.disk_free_percent[at]);
        }
        let [watch, warning, critical] = into.disk_free_percent;
        let known = free.keys().all(|word| ["watch", "warning", "critical"].contains(&word.as_str()));
        if !(known
            && watch >= warning
            && warning >= critical
            && (0.0..=100.0).contains(&critical)
            && watch <= 100.0)
        {
            return fail(format!("{key}.free_percent"), format!("{free:?}"), remedy);
        }
        any = true;
    }
    if any && section.subject.is_some() {
        return fail(
            format!("{key}.subject"),
            "numbers of a kind hold for all subjects",
            "Put the numbers into a rule of this kind without a subject.",
        );
    }
    Ok(())
}

impl TargetSection {
    fn check(&self, key: &str) -> Checked {
        mission::LinkId::new(&self.name).map_err(|error| {
            ConfigError::value(format!("{key}.name"), error.to_string(), "Choose another name.")
        })?;
        let needs_secret = match self.kind {
            TargetKind::Email => self.user.is_some(),
            _ => true,
        };
        match (&self.secret_file, &self.secret_env) {
            (Some(_), Some(_)) => {
                return fail(
                    format!("{key}.secret_env"),
                    "secret_file is there as well",
                    "Give one of them.",
                );
            }
            (None, None) if needs_secret => {
                return fail(
                    format!("{key}.secret_file"),
                    "it is missing",
                    "Name a file of mode 0600 that holds the secret, or a variable with secret_env.",
                );
            }
            (_, Some(name))
                if name.is_empty() || name.bytes().any(|b| !(b.is_ascii_alphanumeric() || b == b'_')) =>
            {
                return fail(
                    format!("{key}.secret_env"),
                    "no name of a variable",
                    "Give its name, not the secret.",
                );
            }
            _ => {}
        }
        let mine = match self.kind {
            TargetKind::Email => ["server", "from", "to", "user"].as_slice(),
            TargetKind::Webhook => &["url"],
            TargetKind::Matrix => &["url", "room"],
            TargetKind::Slack | TargetKind::Discord => &[],
        };
        for (name, given) in [
            ("url", self.url.is_some()),
            ("server", self.server.is_some()),
            ("from", self.from.is_some()),
            ("to", !self.to.is_empty()),
            ("user", self.user.is_some()),
            ("room", self.room.is_some()),
        ] {
            let (key, belongs) = (format!("{key}.{name}"), mine.contains(&name));
            if given && !belongs {
                return fail(key, "this kind of target has no such key", "Remove it.");
            }
            if belongs && !given && name != "user" {
                return fail(key, "it is missing", "docs/alerts.md has an example of each kind.");
            }
        }
        match self.kind {
            TargetKind::Email => self.check_email(key),
            TargetKind::Webhook | TargetKind::Matrix => {
                let url = self.url.as_deref().unwrap_or_default();
                target_url(url)
                    .map_err(|(problem, remedy)| ConfigError::value(format!("{key}.url"), problem, remedy))?;
                match &self.room {
                    Some(room) if !(room.starts_with('!') && room.len() <= 255) => fail(
                        format!("{key}.room"),
                        format!("'{}'", room.chars().take(80).collect::<String>()),
                        "Give the room's id, !…:server; clients show it among the room's settings.",
                    ),
                    _ => Ok(()),
                }
            }
            TargetKind::Slack | TargetKind::Discord => Ok(()),
        }
    }

    fn check_email(&self, key: &str) -> Checked {
        let (host, _) = self.mail_server(key)?;
        let local = host == "localhost" || host.parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback());
        if self.security == TransportSecurity::None && !local {
            return fail(
                format!("{key}.security"),
                format!("'none' to {host}"),
                "Without TLS only to this machine: give starttls or tls.",
            );
        }
        let from = self.from.iter().map(|address| ("from", address));
        for (name, address) in from.chain(self.to.iter().map(|address| ("to", address))) {
            if address.parse::<lettre::message::Mailbox>().is_err() {
                let shown: String = address.chars().take(80).collect();
                return fail(
                    format!("{key}.{name}"),
                    format!("'{shown}' is no address"),
                    "Give name@host, or Name <name@host>.",
                );
            }
        }
        Ok(())
    }

    /// Host and port of the mail server.
    pub(crate) fn mail_server(&self, key: &str) -> Checked<(String, u16)> {
        let server = self.server.as_deref().unwrap_or_default();
        let found = server.rsplit_once(':').and_then(|(host, port)| {
            let host = host.trim_start_matches('[').trim_end_matches(']');
            let port = port.parse::<u16>().ok().filter(|port| *port > 0)?;
            (!host.is_empty() && !host.contains(char::is_whitespace)).then(|| (host.to_owned(), port))
        });
        match found {
            Some(found) => Ok(found),
            None => fail(
                format!("{key}.server"),
                format!("'{}'", server.chars().take(80).collect::<String>()),
                "Give host:port, as in mail.example.org:587.",
            ),
        }
    }

    /// Where it leads, without secrets.
    pub fn shown(&self) -> String {
        match self.kind {
            TargetKind::Email => {
                format!("e-mail to {} by {}", self.to.join(", "), self.server.as_deref().unwrap_or_default())
            }
            TargetKind::Webhook => format!("webhook {}", self.url.as_deref().unwrap_or_default()),
            TargetKind::Matrix => format!(
                "Matrix room {} by {}",
                self.room.as_deref().unwrap_or_default(),
                self.url.as_deref().unwrap_or_default()
            ),
            TargetKind::Slack => "Slack".to_owned(),
            TargetKind::Discord => "Discord".to_owned(),
        }
    }
}

/// An address that messages may go to: encrypted, or on this machine; no login in it.
pub(crate) fn target_url(text: &str) -> Result<Url, (String, &'static str)> {
    let url = Url::parse(text)
        .map_err(|error| (format!("it is no address ({error})"), "Give https://host/path."))?;
    if !url.username().is_empty() || url.password().is_some() {
        return Err(("a name or password stands in it".into(), "Leave it out: addresses are shown."));
    }
    match url.scheme() {
        "https" => Ok(url),
        "http" if is_loopback(&url) => Ok(url),
        scheme => {
            Err((format!("'{scheme}' to another machine"), "Write https: alerts are nobody else's business."))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section(text: &str) -> AlertsSection {
        toml::from_str(text).unwrap()
    }

    const TARGETS: &str = "
        [[targets]]
        name = \"mail\"
        kind = \"email\"
        server = \"mail.example.org:587\"
        from = \"Ground <ground@example.org>\"
        to = [\"ops@example.org\"]
        user = \"ground\"
        secret_env = \"GS_MAIL\"
        [[targets]]
        name = \"lead\"
        kind = \"webhook\"
        url = \"https://example.org/hook\"
        secret_file = \"hook.key\"
        min_level = \"distress\"
        quiet = false
        [[targets]]
        name = \"room\"
        kind = \"matrix\"
        url = \"https://matrix.example.org\"
        room = \"!abc:example.org\"
        secret_file = \"matrix.token\"
        [[targets]]
        name = \"chat\"
        kind = \"slack\"
        secret_file = \"slack.url\"
    ";

    #[test]
    fn without_a_word_all_built_in_rules_hold_and_nobody_is_told() {
        assert_eq!(section("").policy().unwrap(), Policy::default());
    }

    #[test]
    fn who_is_named_by_no_escalation_is_told_at_first() {
        let policy = section(&format!(
            "quiet_hours = [\"21:00-05:30\"]\nescalate = [{{ after_min = 15, to = [\"lead\"] }}]\n{TARGETS}
            [[rules]]\nkind = \"beacon\"\nintervals = 3\nlevel = \"distress\"
            [[rules]]\nkind = \"event\"\nname = \"resets\"\nevents = [\"station\"]\nmin_level = \"watch\"
            [[rules]]\nkind = \"disk\"\nfree_percent = {{ watch = 20 }}\nenabled = true
            [[rules]]\nkind = \"link\"\nsubject = \"spare\"\nenabled = false"
        ))
        .policy()
        .unwrap();
        assert_eq!(policy.notify, ["mail", "room", "chat"]);
        assert_eq!((policy.targets[1].min_level, policy.targets[1].quiet), (Level::Distress, false));
        assert_eq!(policy.thresholds.beacon_intervals, 3);
        assert_eq!(policy.thresholds.disk_free_percent, [20.0, 5.0, 2.0]);
        assert_eq!(policy.rule("beacon").unwrap().level, Some(Level::Distress));
        assert_eq!(policy.rule("resets").unwrap().events, [EventKind::Station]);
        assert!(!policy.rule("link spare").unwrap().enabled && policy.rule("link").unwrap().enabled);
    }

    #[test]
    fn each_mistake_names_its_key_and_a_remedy() {
        for (change, to, says) in [
            ("", "quiet_hours = [\"9-5\"]", "alerts.quiet_hours[0]"),
            ("", "notify = [\"nobody\"]", "alerts.notify"),
            ("", "settle_min = 0", "alerts.settle_min"),
            ("", "escalate = [{ after_min = 0, to = [] }]", "alerts.escalate[0].after_min"),
            ("", "escalate = [{ after_min = 5, to = [\"x\"] }]", "alerts.escalate[0].to"),
            ("kind = \"slack\"", "kind = \"slack\"\nurl = \"https://hooks\"", "alerts.targets[3].url"),
            ("name = \"chat\"", "name = \"room\"", "alerts.targets[3].name"),
            ("name = \"chat\"", "name = \"The chat\"", "alerts.targets[3].name"),
            ("secret_file = \"hook.key\"", "", "alerts.targets[1].secret_file"),
            ("secret_file = \"hook.key\"", "secret_env = \"a b\"", "alerts.targets[1].secret_env"),
            ("https://example.org/hook", "http://example.org/hook", "alerts.targets[1].url"),
            ("https://example.org/hook", "https://me:hunter2@example.org/hook", "alerts.targets[1].url"),
            ("\"!abc:example.org\"", "\"#abc:example.org\"", "alerts.targets[2].room"),
            ("mail.example.org:587", "mail.example.org", "alerts.targets[0].server"),
            ("user = \"ground\"", "security = \"none\"", "alerts.targets[0].security"),
            ("ops@example.org", "ops", "alerts.targets[0].to"),
            ("min_level = \"distress\"", "min_level = \"bad\"", "alerts.targets[1].min_level"),
            ("+", "[[rules]]\nkind = \"lunch\"", "alerts.rules[0].kind"),
            ("+", "[[rules]]\nkind = \"disk\"\nintervals = 2", "alerts.rules[0].intervals"),
            ("+", "[[rules]]\nkind = \"beacon\"\nintervals = 0", "alerts.rules[0].intervals"),
            ("+", "[[rules]]\nkind = \"beacon\"\nsubject = \"a\"\nintervals = 2", "alerts.rules[0].subject"),
            ("+", "[[rules]]\nkind = \"beacon\"\n[[rules]]\nkind = \"beacon\"", "alerts.rules[1].name"),
            ("+", "[[rules]]\nkind = \"disk\"\nfree_percent = { watch = 1 }", "alerts.rules[0].free_percent"),
            ("+", "[[rules]]\nkind = \"event\"\nevents = [\"alert\"]", "alerts.rules[0].events"),
            ("+", "[[rules]]\nkind = \"link\"\non_delay_s = 90000", "alerts.rules[0].on_delay_s"),
            ("+", "[[rules]]\nkind = \"link\"\nname = \"disk\"", "alerts.rules[0].name"),
        ] {
            let text = match change {
                "" => format!("{to}\n{TARGETS}"),
                "+" => format!("{TARGETS}\n{to}"),
                change => TARGETS.replace(change, to),
            };
            let error = section(&text).policy().unwrap_err().to_string();
            assert!(error.contains(says) && error.ends_with('.'), "{to}: {error}");
            assert!(!error.contains("hunter2"), "{error}");
        }
    }
}
