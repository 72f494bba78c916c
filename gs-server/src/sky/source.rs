//! Texts of elements to objects, each with all its sets. One broken set stops nothing: it is listed.

use std::collections::HashMap;

use api::RefusedElements;
use tle::formats::{self, Checksums, SetError, SourceError};
use tle::{Elements, Propagator, UtcInstant, best_for};

/// One object with its sets, in the order of their epochs.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// At least one set.
    sets: Vec<Elements>,
}

impl Object {
    /// An object known by one set.
    #[must_use]
    pub fn of(elements: Elements) -> Self {
        Self { sets: vec![elements] }
    }

    /// An object known by these sets; of two with one epoch the later one counts. `None` without any.
    #[must_use]
    pub fn of_sets(mut sets: Vec<Elements>) -> Option<Self> {
        sets.sort_by_key(|set| set.epoch);
        (!sets.is_empty()).then_some(Self { sets })
    }

    /// An object with all its sets under a name of ours; `None` without a set.
    #[must_use]
    pub fn named(name: &str, mut sets: Vec<Elements>) -> Option<Self> {
        sets.sort_by_key(|set| set.epoch);
        for set in &mut sets {
            set.name = Some(name.to_owned());
        }
        (!sets.is_empty()).then_some(Self { sets })
    }

    /// All sets, in the order of their epochs.
    #[must_use]
    pub fn sets(&self) -> &[Elements] {
        &self.sets
    }

    /// The set for an instant: the newest at or before it, else the nearest. An object has at least one.
    #[must_use]
    pub fn set_for(&self, at: UtcInstant) -> &Elements {
        best_for(&self.sets, at).unwrap_or(&self.sets[0])
    }

    /// What to call it: the newest name among its sets, else its number or designator.
    #[must_use]
    pub fn label(&self) -> String {
        let named = self.sets.iter().rev().find(|set| set.name.is_some());
        named.unwrap_or(&self.sets[0]).label()
    }

    /// Its catalogue number.
    #[must_use]
    pub fn norad_cat_id(&self) -> Option<u32> {
        self.sets.iter().rev().find_map(|set| set.norad_cat_id)
    }

    fn matches(&self, wanted: &str) -> bool {
        let number = wanted.parse::<u32>().ok();
        self.sets.iter().any(|set| {
            let same = |text: &Option<String>| {
                text.as_ref().is_some_and(|text| text.trim().eq_ignore_ascii_case(wanted))
            };
            (number.is_some() && set.norad_cat_id == number) || same(&set.name) || same(&set.object_id)
        })
    }
}

/// By what two sets are known to be of one object.
#[derive(PartialEq, Eq, Hash)]
enum Identity {
    Number(u32),
    Designator(String),
    Name(String),
}

impl Identity {
    /// `None`: nothing tells, so the set is an object of its own. Number 0 stands for "not catalogued yet".
    fn of(set: &Elements) -> Option<Self> {
        set.norad_cat_id
            .filter(|&number| number != 0)
            .map(Self::Number)
            .or_else(|| set.object_id.clone().map(Self::Designator))
            .or_else(|| set.name.clone().map(Self::Name))
    }
}

/// What files of elements held.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Catalogue {
    /// The objects, in the order in which they first stood there.
    pub objects: Vec<Object>,
    /// Sets that cannot be used.
    pub refused: Vec<RefusedElements>,
    /// What was odd but understood, as sentences with their place.
    pub warnings: Vec<String>,
}

impl Catalogue {
    /// Adds the sets of a text. `source` names it in what is refused.
    ///
    /// # Errors
    /// When the text as a whole is no elements.
    pub fn read(&mut self, source: &str, bytes: &[u8], checksums: Checksums) -> Result<(), SourceError> {
        let text = formats::text_of(bytes)?;
        let mut index: HashMap<Identity, usize> = HashMap::new();
        for (at, object) in self.objects.iter().enumerate() {
            if let Some(identity) = Identity::of(&object.sets[0]) {
                index.insert(identity, at);
            }
        }
        for item in formats::sets(&text, checksums)? {
            let found = match item {
                Ok(found) => found,
                Err(SetError { line, object, fault }) => {
                    self.refuse(source, line, object, fault.to_string());
                    continue;
                }
            };
            let label = found.elements.label();
            if let Err(error) = Propagator::new(&found.elements) {
                self.refuse(source, found.line, Some(label), error.to_string());
                continue;
            }
            self.warnings.extend(
                found
                    .warnings
                    .iter()
                    .map(|warning| format!("{source}, line {} ({label}): {warning}", found.line)),
            );
            let at = match Identity::of(&found.elements) {
                Some(identity) => *index.entry(identity).or_insert(self.objects.len()),
                None => self.objects.len(),
            };
            match self.objects.get_mut(at) {
                Some(object) => object.sets.push(found.elements),
                None => self.objects.push(Object::of(found.elements)),
            }
        }
        for object in &mut self.objects {
            object.sets.sort_by_key(|set| set.epoch);
        }
        Ok(())
    }

    /// Keeps the objects that one of `wanted` names: by name (in any case), catalogue number or designator.
    ///
    /// # Errors
    /// A name that none has, with some that there are.
    pub fn keep(&mut self, wanted: &[String]) -> Result<(), String> {
        for name in wanted {
            if !self.objects.iter().any(|object| object.matches(name.trim())) {
                return Err(self.not_found(name));
            }
        }
        self.objects.retain(|object| wanted.iter().any(|name| object.matches(name.trim())));
        Ok(())
    }

    fn not_found(&self, name: &str) -> String {
        let lower = name.trim().to_lowercase();
        let labels = || self.objects.iter().map(Object::label);
        let mut near: Vec<_> =
            labels().filter(|label| label.to_lowercase().contains(&lower)).take(5).collect();
        if near.is_empty() {
            near = labels().take(5).collect();
        }
        format!(
            "no satellite '{name}' among {} objects: give a name, catalogue number or designator that is there, such as {}",
            self.objects.len(),
            near.join(", ")
        )
    }

    fn refuse(&mut self, source: &str, line: usize, object: Option<String>, error: String) {
        self.refused.push(RefusedElements {
            source: source.to_owned(),
            line: line.try_into().unwrap_or(u64::MAX),
            object,
            error,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992";
    const LATER: &str = "1 25544U 98067A   20196.88612269 -.00002218  00000-0 -31515-4 0  9994";
    const TWO: &str = "2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008";

    #[test]
    fn sets_of_one_object_come_together_in_order_and_broken_ones_are_listed() {
        let mut catalogue = Catalogue::default();
        let text = format!("{LATER}\n{TWO}\n{ONE}\nISS (ZARYA)\n{ONE}\n{TWO}\n");
        catalogue.read("a.tle", text.as_bytes(), Checksums::Strict).unwrap();
        assert_eq!(catalogue.objects.len(), 1);
        let object = &catalogue.objects[0];
        assert_eq!(object.sets().len(), 2);
        assert!(object.sets()[0].epoch < object.sets()[1].epoch);
        assert_eq!(object.set_for(object.sets()[1].epoch.plus_us(-1)), &object.sets()[0]);
        assert_eq!(object.set_for(object.sets()[1].epoch), &object.sets()[1]);
        assert_eq!(catalogue.refused.len(), 1);
        assert_eq!((catalogue.refused[0].source.as_str(), catalogue.refused[0].line), ("a.tle", 3));
        catalogue.read("b.tle", format!("{ONE}\n{TWO}\n").as_bytes(), Checksums::Strict).unwrap();
        assert_eq!((catalogue.objects.len(), catalogue.objects[0].sets().len()), (1, 3));
    }

    #[test]
    fn satellites_are_chosen_by_name_number_or_designator() {
        let text = format!("ISS (ZARYA)\n{ONE}\n{TWO}\n");
        for wanted in ["iss (zarya)", "25544", "1998-067a"] {
            let mut catalogue = Catalogue::default();
            catalogue.read("a", text.as_bytes(), Checksums::Strict).unwrap();
            catalogue.keep(&[wanted.to_owned()]).unwrap();
            assert_eq!(catalogue.objects.len(), 1, "{wanted}");
        }
        let mut catalogue = Catalogue::default();
        catalogue.read("a", text.as_bytes(), Checksums::Strict).unwrap();
        let error = catalogue.keep(&["iss".to_owned()]).unwrap_err();
        assert!(error.contains("ISS (ZARYA)"), "{error}");
    }
}
