//! What the operator prepares to send: drafts, templates and stacks. All of it survives the window, and a kill of it.

use std::collections::BTreeMap;

use api::client::IdempotencyKey;
use api::telecommand::{Argument, Default as Left, Definition, Kind};
use api::{CommandRequest, GateWord};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Drafts, templates, stacks that are kept at most, each.
pub const KEPT_MAX: usize = 100;

/// What the operator prepares to send.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CommandDesk {
    /// Drafts, oldest first.
    pub drafts: Vec<Draft>,
    /// The draft that is open.
    pub open: usize,
    /// Drafts that were kept under a name, to begin with.
    pub templates: Vec<Template>,
    /// Several commands in a row.
    pub stacks: Vec<Stack>,
    /// The stack that is open.
    pub open_stack: usize,
}

/// A draft under a name.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Template {
    /// What the operator calls it.
    pub name: String,
    /// What it begins with.
    pub draft: Draft,
}

/// A telecommand as far as it is filled in.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Draft {
    /// The telecommand's name.
    pub command: String,
    /// What stands in each field, by its path (`count`, `slots[0].time`).
    pub fields: BTreeMap<String, String>,
    /// How many entries each list has.
    pub entries: BTreeMap<String, usize>,
    /// When it may leave.
    pub gate: Gate,
    /// What was asked for, from the moment of the click until an answer came.
    pub asked: Option<Asked>,
}

/// What was asked for, and under which key: asked again, it is the very same request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Asked {
    /// Idempotency key.
    pub key: String,
    /// The request.
    pub request: CommandRequest,
    /// Address of the server that was asked: the key means nothing to another one.
    #[serde(default)]
    pub server: String,
}

/// When a command may leave: as it is typed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Gate {
    /// To whom; empty: the satellite that is looked at.
    pub satellite: String,
    /// Over what; empty: the satellite's only link.
    pub link: String,
    /// Also while the satellite is not heard.
    pub blind: bool,
    /// The satellite stands at least so high, degrees; empty: no matter.
    pub elevation_deg: String,
    /// It was heard within so many seconds; empty: as the station has it.
    pub heard_within_s: String,
    /// Given up after so many minutes; empty: never.
    pub expires_min: String,
    /// Higher goes first.
    pub priority: i16,
    /// How often it may be radiated; empty: as the station has it.
    pub attempts: String,
}

impl Default for Gate {
    fn default() -> Self {
        Self {
            satellite: String::new(),
            link: String::new(),
            blind: false,
            elevation_deg: String::new(),
            heard_within_s: String::new(),
            expires_min: "30".to_owned(),
            priority: 0,
            attempts: String::new(),
        }
    }
}

/// Several commands with waits and conditions: the server runs it as a plan.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Stack {
    /// Its name: that of the plan.
    pub name: String,
    /// In this order.
    pub steps: Vec<StackStep>,
    /// Under which it was handed over, until an answer came.
    pub key: Option<String>,
}

/// One step of a stack.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StackStep {
    /// What it sends, and when it may leave.
    pub draft: Draft,
    /// Waits so many seconds before; empty: none.
    pub wait_s: String,
    /// The stack goes on when this fails.
    pub go_on: bool,
}

impl Draft {
    /// An empty one: what has a default has it.
    #[must_use]
    pub fn of(command: &str) -> Self {
        let mut draft = Self { command: command.to_owned(), ..Self::default() };
        if let Some(definition) = Definition::find(command) {
            draft.command = definition.name.to_owned();
            draft.begin(definition.arguments, "");
        }
        draft
    }

    /// Filled with the words that were typed behind the name: `getimagechunk 3 10`.
    #[must_use]
    pub fn with_words<'a>(command: &str, words: impl Iterator<Item = &'a str>) -> Self {
        let mut draft = Self::of(command);
        let scalar =
            |argument: &&Argument| !matches!(argument.kind, Kind::List { .. } | Kind::Vectors { .. });
        let names = Definition::find(command).map_or(&[][..], |definition| definition.arguments);
        for (argument, word) in names.iter().filter(scalar).zip(words) {
            let word = match (argument.kind, word) {
                (Kind::Flag, "on" | "yes" | "1") => "true",
                (Kind::Flag, "off" | "no" | "0") => "false",
                (Kind::Choice(choices), word) => {
                    choices.iter().find(|choice| choice.eq_ignore_ascii_case(word)).copied().unwrap_or(word)
                }
                (_, word) => word,
            };
            draft.fields.insert(argument.name.to_owned(), word.to_owned());
        }
        draft
    }

    /// Filled with the arguments of a command that was sent.
    #[must_use]
    pub fn again(command: &str, arguments: &Map<String, Value>) -> Self {
        let mut draft = Self::of(command);
        if let Some(definition) = Definition::find(command) {
            draft.fill(definition.arguments, arguments, "");
        }
        draft
    }

    /// Fields of their defaults.
    fn begin(&mut self, arguments: &[Argument], at: &str) {
        for argument in arguments {
            let path = format!("{at}{}", argument.name);
            match (argument.kind, argument.default) {
                (Kind::List { min, entry, .. }, _) => {
                    self.entries.insert(path.clone(), 0);
                    (0..min).for_each(|_| self.add_entry(&path, entry));
                }
                (Kind::Vectors { min, .. }, _) => drop(self.entries.insert(path, min)),
                (Kind::Choice([first, ..]), _) => drop(self.fields.insert(path, (*first).to_owned())),
                (_, Some(Left::Whole(number))) => drop(self.fields.insert(path, number.to_string())),
                (Kind::Flag, default) => {
                    let is_on = matches!(default, Some(Left::Flag(true)));
                    self.fields.insert(path, is_on.to_string());
                }
                _ => {}
            }
        }
    }

    /// One more entry of a list.
    pub fn add_entry(&mut self, path: &str, entry: &[Argument]) {
        let count = self.entries.entry(path.to_owned()).or_default();
        let at = format!("{path}[{count}].");
        *count += 1;
        self.begin(entry, &at);
    }

    /// Takes an entry of a list away; those behind move up.
    pub fn remove_entry(&mut self, path: &str, index: usize) {
        let Some(count) = self.entries.get_mut(path).filter(|count| index < **count) else { return };
        *count -= 1;
        let fields = std::mem::take(&mut self.fields);
        for (name, text) in fields {
            let place = name.strip_prefix(path).and_then(|rest| rest.strip_prefix('['));
            let parts = place.and_then(|rest| rest.split_once(']'));
            match parts.and_then(|(number, rest)| Some((number.parse::<usize>().ok()?, rest))) {
                Some((number, _)) if number == index => {}
                Some((number, rest)) if number > index => {
                    self.fields.insert(format!("{path}[{}]{rest}", number - 1), text);
                }
                _ => drop(self.fields.insert(name, text)),
            }
        }
    }

    fn fill(&mut self, arguments: &[Argument], values: &Map<String, Value>, at: &str) {
        for argument in arguments {
            let path = format!("{at}{}", argument.name);
            let Some(value) = values.get(argument.name).filter(|value| !value.is_null()) else { continue };
            match (argument.kind, value) {
                (Kind::List { entry, .. }, Value::Array(list)) => {
                    self.entries.insert(path.clone(), list.len());
                    for (index, value) in list.iter().enumerate() {
                        if let Value::Object(map) = value {
                            self.fill(entry, map, &format!("{path}[{index}]."));
                        }
                    }
                }
                (Kind::Vectors { .. }, Value::Array(list)) => {
                    self.entries.insert(path.clone(), list.len());
                    for (index, value) in list.iter().enumerate() {
                        self.fields.insert(format!("{path}[{index}]"), words(value));
                    }
                }
                (_, value) => drop(self.fields.insert(path, words(value))),
            }
        }
    }

    /// The arguments as they are sent. What is no number stays the text that it is: whoever reads it says what is wrong.
    #[must_use]
    pub fn arguments(&self) -> Map<String, Value> {
        let definition = Definition::find(&self.command);
        definition.map_or_else(Map::new, |definition| self.object(definition.arguments, ""))
    }

    fn object(&self, arguments: &[Argument], at: &str) -> Map<String, Value> {
        let mut map = Map::new();
        for argument in arguments {
            let path = format!("{at}{}", argument.name);
            let count = self.entries.get(&path).copied().unwrap_or(0);
            let value = match argument.kind {
                Kind::List { entry, .. } => {
                    let one = |index| Value::Object(self.object(entry, &format!("{path}[{index}].")));
                    Some((0..count).map(one).collect())
                }
                Kind::Vectors { .. } => {
                    let one = |index| self.text(&format!("{path}[{index}]"));
                    Some((0..count).map(|index| typed(Kind::Vector, one(index))).collect())
                }
                kind => Some(self.text(&path)).filter(|text| !text.is_empty()).map(|text| typed(kind, text)),
            };
            if let Some(value) = value {
                map.insert(argument.name.to_owned(), value);
            }
        }
        map
    }

    /// What stands in a field.
    #[must_use]
    pub fn text(&self, path: &str) -> &str {
        self.fields.get(path).map_or("", |text| text.trim())
    }

    /// Keeps what is asked for, under a key of its own.
    pub fn ask(&mut self, request: CommandRequest, server: &str) {
        let (key, server) = (IdempotencyKey::fresh().as_str().to_owned(), server.to_owned());
        self.asked = Some(Asked { key, request, server });
    }

    /// What must hold before it leaves.
    #[must_use]
    pub fn gate_word(&self) -> GateWord {
        if self.gate.blind { GateWord::Blind } else { GateWord::Heard }
    }
}

impl CommandDesk {
    /// Opens a draft: the empty one that there is, or a new one. The oldest that waits for no answer goes when there are
    /// too many.
    pub fn open(&mut self, draft: Draft) {
        if let Some(place) = self.drafts.iter().position(|held| *held == draft && held.asked.is_none()) {
            self.open = place;
            return;
        }
        if self.drafts.len() >= KEPT_MAX {
            let oldest = self.drafts.iter().position(|draft| draft.asked.is_none()).unwrap_or(0);
            self.drafts.remove(oldest);
        }
        self.drafts.push(draft);
        self.open = self.drafts.len() - 1;
    }
}

/// A text as the value that it is meant to be.
fn typed(kind: Kind, text: &str) -> Value {
    let as_text = || Value::String(text.to_owned());
    let number =
        |text: &str| text.parse::<f64>().ok().and_then(serde_json::Number::from_f64).map(Value::Number);
    match kind {
        Kind::Whole { .. } => {
            let whole = text.parse::<i128>().ok().and_then(|whole| i64::try_from(whole).ok());
            whole.map(Value::from).or_else(|| number(text)).unwrap_or_else(as_text)
        }
        Kind::Number { .. } => number(text).unwrap_or_else(as_text),
        Kind::Flag => text.parse::<bool>().map_or_else(|_| as_text(), Value::Bool),
        Kind::Vector => {
            let parts = text.split([',', ' ']).filter(|part| !part.is_empty());
            parts.map(|part| number(part).unwrap_or_else(|| Value::String(part.to_owned()))).collect()
        }
        _ => as_text(),
    }
}

/// A value as it is typed.
fn words(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(list) => list.iter().map(words).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use api::telecommand::{self, DEFINITIONS};
    use serde_json::json;

    use super::*;

    #[test]
    fn words_behind_a_name_fill_the_fields_in_order() {
        let draft = Draft::with_words("getimagechunk", "3 10".split(' '));
        assert_eq!(Value::Object(draft.arguments()), json!({"first": 3, "count": 10}));
        let draft = Draft::with_words("CaptureImage", "svga yes".split(' '));
        let expected = json!({"resolution": "SVGA", "grey": true, "strong_compression": false});
        assert_eq!(Value::Object(draft.arguments()), expected);
        let draft = Draft::with_words("SetMode", std::iter::once("5"));
        assert_eq!(Value::Object(draft.arguments()), json!({"mode": 5, "substate": 255}));
    }

    #[test]
    fn what_was_sent_comes_back_into_the_form_as_it_was() {
        let slots = json!({"slots": [
            {"time": "2026-11-22T05:00:00.000Z", "first": 0, "count": 9},
            {"time": "2026-11-22T06:00:00.000Z", "first": 9, "count": 9, "attitude_mrp": [0.1, 0.2, 0.3]},
            {"time": "2026-11-22T07:00:00.000Z", "first": 18, "count": 9},
        ]});
        let mut draft = Draft::again("SetDownlinkSchedule", slots.as_object().unwrap());
        assert_eq!(Value::Object(draft.arguments()), slots);
        draft.remove_entry("slots", 0);
        assert_eq!(draft.arguments()["slots"][0], slots["slots"][1]);
        assert_eq!(draft.arguments()["slots"].as_array().unwrap().len(), 2);
        let guidance = json!({"id": 1, "actuator": 0, "start": "2026-11-22T05:00:00Z", "coefficients": [[0.5, 1.0, 2.0]]});
        let draft = Draft::again("UploadGuidance", guidance.as_object().unwrap());
        assert_eq!(Value::Object(draft.arguments()), guidance);
    }

    #[test]
    fn an_empty_form_of_every_telecommand_says_what_is_missing_and_nothing_else() {
        for definition in &DEFINITIONS {
            match telecommand::parse(definition.name, &Draft::of(definition.name).arguments()) {
                Ok(command) => assert_eq!(command.name(), definition.name),
                Err(errors) => {
                    for error in errors {
                        let told =
                            error.message.contains("is missing") || error.message.contains("must be three");
                        assert!(told, "{}: {error}", definition.name);
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_number_stays_text_and_is_refused_by_its_field() {
        let draft = Draft::with_words("GetImageChunk", "x 65".split(' '));
        let errors = telecommand::parse("GetImageChunk", &draft.arguments()).unwrap_err();
        let told: Vec<String> = errors.iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            [
                "arguments.first: must be a whole number from 0 to 65535, found \"x\"",
                "arguments.count: must be a whole number from 1 to 64, found 65",
            ]
        );
    }

    #[test]
    fn a_key_stays_until_an_answer_came_and_there_are_never_too_many_drafts() {
        let mut draft = Draft::of("Ping");
        draft.ask(serde_json::from_value(json!({"command": "Ping"})).unwrap(), "http://127.0.0.1:8700");
        let kept: Draft = serde_json::from_str(&serde_json::to_string(&draft).unwrap()).unwrap();
        assert_eq!(kept, draft);
        let mut desk = CommandDesk::default();
        desk.open(draft.clone());
        for first in 0..2 * KEPT_MAX {
            desk.open(Draft::with_words("GetEvents", std::iter::once(first.to_string().as_str())));
        }
        assert_eq!(desk.drafts.len(), KEPT_MAX);
        assert!(desk.drafts.contains(&draft), "what waits for its answer stays");
    }
}
