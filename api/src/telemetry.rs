//! Values over time.

use serde::{Deserialize, Serialize};

use crate::Time;

/// One parameter over a range of time.
///
/// Few values come as they are in `samples`; many are thinned into `buckets` of equal length that keep minimum and
/// maximum, so that no spike is lost. One of the two is empty.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TelemetryPage {
    /// Parameter, e.g. `heartbeat.temp`.
    pub parameter: String,
    /// Unit; empty when it has none or nobody knows it.
    pub unit: String,
    /// Satellite.
    pub satellite: String,
    /// Begin of the range; `null` when open.
    pub start: Option<Time>,
    /// End of the range, not included; `null` when open.
    pub stop: Option<Time>,
    /// Whether the values were thinned.
    pub decimated: bool,
    /// The values themselves.
    pub samples: Vec<Sample>,
    /// The values, thinned.
    pub buckets: Vec<Bucket>,
}

/// One value.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// When it was heard.
    pub at: Time,
    /// The value; `null` when invalid (a failed sensor).
    pub value: Option<f64>,
    /// The frame it stands in.
    pub frame: u64,
}

/// Many values.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bucket {
    /// Begin of the bucket.
    pub start: Time,
    /// End of the bucket, not included.
    pub stop: Time,
    /// Least valid value.
    pub min: Option<f64>,
    /// Greatest valid value.
    pub max: Option<f64>,
    /// Mean of the valid values.
    pub avg: Option<f64>,
    /// Number of valid values.
    pub count: u64,
    /// Number of invalid values.
    pub invalid: u64,
    /// The newest value in it, valid or not.
    pub last: Sample,
}

/// The newest value of a parameter.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LatestValue {
    /// Parameter.
    pub parameter: String,
    /// Unit; empty when it has none or nobody knows it.
    pub unit: String,
    /// The value; `null` when invalid.
    pub value: Option<f64>,
    /// When it was heard.
    pub at: Time,
    /// The frame it stands in.
    pub frame: u64,
    /// Satellite.
    pub satellite: String,
    /// Station.
    pub station: String,
    /// Link.
    pub link: String,
}

/// A parameter of which there are values.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParameterView {
    /// Parameter.
    pub parameter: String,
    /// Unit; empty when it has none or nobody knows it.
    pub unit: String,
    /// Satellite.
    pub satellite: String,
}
