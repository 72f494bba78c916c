//! Elements of our satellites: given by operators, fetched from sources, held in the archive.

use serde::{Deserialize, Serialize};

use crate::{ElementsView, RefusedElements, Time};

/// Elements for one satellite. The text may hold other objects, too: those of the satellite are taken.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ElementsRequest {
    /// Whose; the only satellite when `null`.
    #[serde(default)]
    pub satellite: Option<String>,
    /// OMM as JSON, CSV, XML or KVN, or TLE with two or three lines; any number of sets.
    pub text: String,
    /// Where they came from, for people; no secrets.
    #[serde(default)]
    pub source: Option<String>,
    /// Use a TLE whose checksum does not fit, with a warning.
    #[serde(default)]
    pub lenient: bool,
}

/// What became of elements for one satellite.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ElementsAdded {
    /// Whose.
    pub satellite: String,
    /// Sets that are new.
    pub added: u64,
    /// Sets that were held already.
    pub held: u64,
    /// The newest epoch among them; `null` without any.
    pub newest_epoch: Option<crate::FineTime>,
    /// Sets of other objects, passed over.
    pub of_others: u64,
    /// Sets that could not be used.
    pub refused: Vec<RefusedElements>,
    /// What was odd and used all the same.
    pub warnings: Vec<String>,
}

/// Elements that the archive holds.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldElements {
    /// Number in the archive; passes name it.
    pub id: u64,
    /// Whose.
    pub satellite: String,
    /// The station that keeps them.
    pub station: String,
    /// Where they came from.
    pub source: String,
    /// When they were added.
    pub added_at: Time,
    /// Who added them.
    pub added_by: String,
    /// The newest at or before now, else the nearest: these are used now.
    pub in_use: bool,
    /// Days since their epoch; negative before it.
    pub age_days: f64,
    /// What error of AOS and LOS to expect now, one sigma by a rule of thumb.
    pub timing_error_s: f64,
    /// How much anybody should care: `normal`, `watch`, `warning`, `distress`.
    pub level: String,
    /// The elements.
    pub elements: ElementsView,
}

/// How it stands with one source.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceWord {
    /// It was never asked.
    New,
    /// The last download is good; `next_at` says when it is asked again.
    Good,
    /// The last attempt failed; it is asked again at `next_at`.
    Failed,
    /// It refused: it is not asked again until an operator says so.
    Stopped,
}

/// One source of elements.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ElementsSource {
    /// Its address.
    pub url: String,
    /// How it stands.
    pub state: SourceWord,
    /// When it was last asked.
    pub asked_at: Option<Time>,
    /// When it last gave elements.
    pub downloaded_at: Option<Time>,
    /// When the server asks it next by itself; `null` when it does not.
    pub next_at: Option<Time>,
    /// What it said last, and what to do where something is to be done.
    pub detail: Option<String>,
}

/// What became of one source when it was to be asked.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FetchWord {
    /// It gave elements.
    Downloaded,
    /// It was not asked: the last request is too recent.
    TooEarly,
    /// It has nothing newer: what is held stays good.
    NotUpdated,
    /// It gave no elements: what is held stays in use.
    Failed,
    /// It refused, and is not asked again until an operator says so.
    Stopped,
}

/// What became of one source.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SourceFetched {
    /// Its address.
    pub url: String,
    /// In a word.
    pub outcome: FetchWord,
    /// In a sentence, with what to do.
    pub detail: String,
    /// What was added, for each of our satellites that it knows.
    pub added: Vec<ElementsAdded>,
    /// Our satellites of which it has nothing, or not one object for certain: why.
    pub unmatched: Vec<String>,
}

/// What became of all sources.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FetchReport {
    /// One by one, in the order of the configuration.
    pub sources: Vec<SourceFetched>,
}
