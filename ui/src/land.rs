//! The land of the Earth, from Natural Earth (`assets/LICENSE-world-atlas.txt`), as triangles in degrees.
//!
//! Two sizes: the coarse one for the whole world, the fine one from some zoom on. Each is decoded once, when it is first
//! drawn. The files are TopoJSON: arcs of whole numbers, shared by rings.

use std::sync::LazyLock;

use earcut::Earcut;
use serde::Deserialize;

use crate::geo::{self, Place};

/// Land as triangles, and its coasts.
#[derive(Debug, Default)]
pub struct Land {
    /// Pieces of land, each small enough to be left out when it is not in view.
    pub pieces: Vec<Piece>,
}

/// One piece of land: an island, a continent.
#[derive(Debug)]
pub struct Piece {
    /// Longitude and latitude in degrees; longitudes may go on over ±180.
    pub corners: Vec<[f32; 2]>,
    /// Three corners each.
    pub triangles: Vec<u32>,
    /// Where each ring begins in `corners`; the first is the outer one, the others are lakes. With the number of corners
    /// as the last.
    pub rings: Vec<usize>,
    /// Least longitude, least latitude, greatest longitude, greatest latitude, degrees.
    pub bounds: [f32; 4],
}

/// The coarse land, 1:110 million.
#[must_use]
pub fn coarse() -> &'static Land {
    static LAND: LazyLock<Land> = LazyLock::new(|| decode(include_str!("../assets/land-110m.json")));
    &LAND
}

/// The fine land, 1:50 million.
#[must_use]
pub fn fine() -> &'static Land {
    static LAND: LazyLock<Land> = LazyLock::new(|| decode(include_str!("../assets/land-50m.json")));
    &LAND
}

#[derive(Deserialize)]
struct Topology {
    arcs: Vec<Vec<[i32; 2]>>,
    transform: Transform,
    objects: Objects,
}

#[derive(Deserialize)]
struct Transform {
    scale: [f64; 2],
    translate: [f64; 2],
}

#[derive(Deserialize)]
struct Objects {
    land: Collection,
}

#[derive(Deserialize)]
struct Collection {
    geometries: Vec<MultiPolygon>,
}

#[derive(Deserialize)]
struct MultiPolygon {
    /// Polygons of rings of arcs; an arc −1−n is arc n backwards.
    arcs: Vec<Vec<Vec<i32>>>,
}

fn decode(text: &str) -> Land {
    #[expect(clippy::expect_used, reason = "the file is a part of the program, and a test reads it")]
    let topology: Topology = serde_json::from_str(text).expect("the land is TopoJSON");
    let arcs: Vec<Vec<Place>> = topology.arcs.iter().map(|arc| places(arc, &topology.transform)).collect();
    let mut earcut = Earcut::new();
    let polygons = topology.objects.land.geometries.iter().flat_map(|geometry| &geometry.arcs);
    Land { pieces: polygons.filter_map(|polygon| piece(polygon, &arcs, &mut earcut)).collect() }
}

fn places(arc: &[[i32; 2]], transform: &Transform) -> Vec<Place> {
    let mut at = [0_i32; 2];
    arc.iter()
        .map(|step| {
            at = [at[0].saturating_add(step[0]), at[1].saturating_add(step[1])];
            Place::new(
                f64::from(at[0]) * transform.scale[0] + transform.translate[0],
                f64::from(at[1]) * transform.scale[1] + transform.translate[1],
            )
        })
        .collect()
}

fn piece(polygon: &[Vec<i32>], arcs: &[Vec<Place>], earcut: &mut Earcut<f32>) -> Option<Piece> {
    let mut corners: Vec<[f32; 2]> = Vec::new();
    let mut rings = Vec::new();
    let mut outer_middle = 0.0;
    for ring in polygon {
        let area = geo::area(&stitch(ring, arcs));
        let (low, high) = geo::span_deg(&area);
        let middle = (low + high) / 2.0;
        if rings.is_empty() {
            outer_middle = middle;
        }
        // A lake lies on the same turn as its land
        let shift = ((outer_middle - middle) / 360.0).round() * 360.0;
        rings.push(corners.len());
        corners.extend(
            area.iter().map(|place| [(place.longitude_deg + shift) as f32, place.latitude_deg as f32]),
        );
    }
    let mut triangles = Vec::new();
    let holes: Vec<u32> = rings.iter().skip(1).filter_map(|&at| u32::try_from(at).ok()).collect();
    earcut.earcut(corners.iter().copied(), &holes, &mut triangles);
    rings.push(corners.len());
    let bounds = corners.iter().fold([f32::MAX, f32::MAX, f32::MIN, f32::MIN], |b, c| {
        [b[0].min(c[0]), b[1].min(c[1]), b[2].max(c[0]), b[3].max(c[1])]
    });
    (corners.len() > 2).then_some(Piece { corners, triangles, rings, bounds })
}

/// A ring from its arcs: each begins where the one before it ends, so the shared corner is taken once.
fn stitch(ring: &[i32], arcs: &[Vec<Place>]) -> Vec<Place> {
    let mut whole = Vec::new();
    for &index in ring {
        let is_backward = index < 0;
        let index = if is_backward { !index } else { index };
        let Some(arc) = usize::try_from(index).ok().and_then(|index| arcs.get(index)) else { continue };
        let count = arc.len().saturating_sub(1);
        if is_backward {
            whole.extend(arc.iter().rev().take(count));
        } else {
            whole.extend(arc.iter().take(count));
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_land(land: &Land, longitude_deg: f32, latitude_deg: f32) -> bool {
        let side = |a: [f32; 2], b: [f32; 2], x: f32, y: f32| {
            (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        };
        [-360.0, 0.0, 360.0].into_iter().any(|turn| {
            let (x, y) = (longitude_deg + turn, latitude_deg);
            land.pieces.iter().any(|piece| {
                piece.triangles.chunks_exact(3).any(|t| {
                    let [a, b, c] = [t[0], t[1], t[2]].map(|at| piece.corners[at as usize]);
                    let sides = [side(a, b, x, y), side(b, c, x, y), side(c, a, x, y)];
                    sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0)
                })
            })
        })
    }

    #[test]
    fn land_and_sea_lie_where_they_lie() {
        for land in [coarse(), fine()] {
            for (x, y, wanted, name) in [
                (-40.0, 45.0, false, "mid-Atlantic"),
                (0.0, 89.5, false, "Arctic sea"),
                (150.0, 85.0, false, "Arctic sea"),
                (0.0, -89.0, true, "Antarctica"),
                (-120.0, -85.0, true, "Antarctica"),
                (179.5, -87.0, true, "Antarctica"),
                (10.0, 24.0, true, "Sahara"),
                (-175.0, 67.0, true, "Chukotka, beyond 180"),
                (170.0, 67.0, true, "Chukotka"),
                (51.0, 42.0, false, "Caspian sea"),
                (-160.0, 0.0, false, "Pacific"),
                (134.0, -25.0, true, "Australia"),
                (6.57, 46.52, true, "Lausanne"),
            ] {
                assert_eq!(is_land(land, x, y), wanted, "{name}");
            }
        }
    }

    #[test]
    fn no_piece_is_wider_than_the_world_and_the_triangles_fill_their_rings() {
        for land in [coarse(), fine()] {
            for piece in &land.pieces {
                assert!(piece.bounds[2] - piece.bounds[0] <= 360.1, "{:?}", piece.bounds);
                let shoelace = |corners: &[[f32; 2]]| -> f64 {
                    let next = corners.iter().cycle().skip(1);
                    let twice = corners
                        .iter()
                        .zip(next)
                        .map(|(a, b)| f64::from(a[0]) * f64::from(b[1]) - f64::from(b[0]) * f64::from(a[1]));
                    (twice.sum::<f64>() / 2.0).abs()
                };
                let rings: Vec<f64> =
                    piece.rings.windows(2).map(|ring| shoelace(&piece.corners[ring[0]..ring[1]])).collect();
                let wanted = rings[0] - rings[1..].iter().sum::<f64>();
                let found: f64 = piece
                    .triangles
                    .chunks_exact(3)
                    .map(|t| shoelace(&[t[0], t[1], t[2]].map(|at| piece.corners[at as usize])))
                    .sum();
                assert!((found - wanted).abs() < 0.01 + wanted * 1e-3, "{found} {wanted} {:?}", piece.bounds);
            }
        }
    }
}
