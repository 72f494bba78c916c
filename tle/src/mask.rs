//! What the horizon hides: the least elevation at which a station sees, by azimuth.

/// A horizon: elevation by azimuth, straight lines between the points of a table, round the circle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HorizonMask {
    /// (azimuth, elevation) in degrees, azimuths in 0..360, ascending. Empty: 0 all round.
    points: Vec<(f64, f64)>,
}

/// Points a mask may have: four a degree.
pub const MASK_POINTS_MAX: usize = 1440;

impl HorizonMask {
    /// An open horizon: elevation 0 all round.
    pub const OPEN: Self = Self { points: Vec::new() };

    /// The same elevation all round, degrees; below 0 for a station on a mountain.
    ///
    /// # Errors
    /// Outside -90 to 90 degrees.
    pub fn flat(elevation_deg: f64) -> Result<Self, MaskError> {
        Self::from_table(&[(0.0, elevation_deg)])
    }

    /// From (azimuth, elevation) in degrees, in any order; azimuth -360 to 360, north 0, east 90.
    ///
    /// # Errors
    /// See [`MaskError`]; it names the point, counted from 1.
    pub fn from_table(table: &[(f64, f64)]) -> Result<Self, MaskError> {
        if table.is_empty() {
            return Err(MaskError::Empty);
        }
        if table.len() > MASK_POINTS_MAX {
            return Err(MaskError::TooManyPoints { found: table.len() });
        }
        let mut points = Vec::with_capacity(table.len());
        for (index, &(azimuth_deg, elevation_deg)) in table.iter().enumerate() {
            let point = index + 1;
            if !(-360.0..=360.0).contains(&azimuth_deg) {
                return Err(MaskError::Azimuth { point, found_deg: azimuth_deg });
            }
            if !(-90.0..=90.0).contains(&elevation_deg) {
                return Err(MaskError::Elevation { point, found_deg: elevation_deg });
            }
            points.push((azimuth_deg.rem_euclid(360.0), elevation_deg));
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        // A table that runs from 0 to 360 names north twice; that is no contradiction if both agree.
        points.dedup_by(|b, a| a == b);
        if let Some(pair) = points.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(MaskError::TwoElevations { azimuth_deg: pair[0].0 });
        }
        Ok(Self { points })
    }

    /// The table: (azimuth, elevation) in degrees, ascending azimuths in 0..360. Empty for an open horizon.
    #[must_use]
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// The least elevation seen at an azimuth, degrees.
    #[must_use]
    pub fn elevation_deg(&self, azimuth_deg: f64) -> f64 {
        let (Some(&first), Some(&last)) = (self.points.first(), self.points.last()) else { return 0.0 };
        let azimuth = azimuth_deg.rem_euclid(360.0);
        let after = self.points.partition_point(|point| point.0 <= azimuth);
        let from = if after == 0 { (last.0 - 360.0, last.1) } else { self.points[after - 1] };
        let to = self.points.get(after).copied().unwrap_or((first.0 + 360.0, first.1));
        let span = to.0 - from.0;
        if span > 0.0 { from.1 + (to.1 - from.1) * ((azimuth - from.0) / span) } else { from.1 }
    }

    /// The lowest and the highest elevation of the horizon, degrees.
    #[must_use]
    pub fn range_deg(&self) -> (f64, f64) {
        let Some(&(_, first)) = self.points.first() else { return (0.0, 0.0) };
        self.points.iter().fold((first, first), |(low, high), &(_, e)| (low.min(e), high.max(e)))
    }
}

/// A table that describes no horizon.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MaskError {
    /// No points.
    #[error("the horizon mask has no points: give at least one pair of azimuth and elevation in degrees")]
    Empty,
    /// More than [`MASK_POINTS_MAX`].
    #[error("the horizon mask has {found} points, more than {MASK_POINTS_MAX}: thin it out to one a degree")]
    TooManyPoints {
        /// Points given.
        found: usize,
    },
    /// An azimuth outside -360 to 360.
    #[error("point {point} of the horizon mask: the azimuth {found_deg} is outside -360 to 360 degrees")]
    Azimuth {
        /// Which point, counted from 1.
        point: usize,
        /// Degrees given.
        found_deg: f64,
    },
    /// An elevation outside -90 to 90.
    #[error("point {point} of the horizon mask: the elevation {found_deg} is outside -90 to 90 degrees")]
    Elevation {
        /// Which point, counted from 1.
        point: usize,
        /// Degrees given.
        found_deg: f64,
    },
    /// Two different elevations at one azimuth.
    #[error(
        "the horizon mask gives two elevations at azimuth {azimuth_deg}: shift one point by a little for a step"
    )]
    TwoElevations {
        /// The azimuth, degrees.
        azimuth_deg: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn horizon_runs_straight_between_points_and_round_north() {
        let mask = HorizonMask::from_table(&[(350.0, 10.0), (10.0, 20.0), (90.0, 0.0)]).unwrap();
        for (azimuth, elevation) in [
            (0.0, 15.0),
            (360.0, 15.0),
            (355.0, 12.5),
            (10.0, 20.0),
            (50.0, 10.0),
            (90.0, 0.0),
            (-10.0, 10.0),
        ] {
            assert!((mask.elevation_deg(azimuth) - elevation).abs() < 1e-12, "{azimuth}");
        }
        assert_eq!(mask.range_deg(), (0.0, 20.0));
        assert_eq!(HorizonMask::flat(-2.0).unwrap().elevation_deg(123.0), -2.0);
        assert_eq!(HorizonMask::OPEN.elevation_deg(123.0), 0.0);
    }

    #[test]
    fn impossible_table_is_refused_by_point() {
        assert_eq!(HorizonMask::from_table(&[]), Err(MaskError::Empty));
        assert_eq!(
            HorizonMask::from_table(&[(0.0, 1.0), (10.0, 91.0)]),
            Err(MaskError::Elevation { point: 2, found_deg: 91.0 })
        );
        assert!(HorizonMask::from_table(&[(f64::NAN, 1.0)]).is_err());
        assert!(HorizonMask::from_table(&[(0.0, 1.0), (360.0, 1.0)]).is_ok());
        assert_eq!(
            HorizonMask::from_table(&[(0.0, 1.0), (360.0, 2.0)]),
            Err(MaskError::TwoElevations { azimuth_deg: 0.0 })
        );
    }
}
