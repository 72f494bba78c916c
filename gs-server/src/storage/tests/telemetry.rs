//! Values over time: few as they are, many thinned out.

use super::super::*;
use super::records::*;
use super::{Kind, fresh};
use mission::record::{Point, Record, TelemetryRecord};
use mission::{FrameId, UtcUs};

async fn store_values(store: &Store, values: &[(i64, Option<f64>)]) {
    let frame = frame_of(1, &protocol::Downlink::Pong, &route());
    let mut records = vec![Record::Frame(frame)];
    for (at_us, value) in values {
        records.push(Record::Telemetry(TelemetryRecord {
            frame: FrameId(1),
            route: route(),
            at: UtcUs(*at_us),
            decoder_version: 1,
            points: vec![Point { parameter: "heartbeat.temp".into(), unit: "°C", value: *value }],
        }));
    }
    store.apply(&batch(records)).await.unwrap();
}

async fn ask(store: &Store, start_us: i64, stop_us: i64, max_points: u32) -> Samples {
    let query = TelemetryQuery {
        satellite: "pixelsat-1".into(),
        parameter: "heartbeat.temp".into(),
        start_us,
        stop_us,
        max_points,
    };
    let series = store.telemetry(&query).await.unwrap().unwrap();
    assert_eq!((series.parameter.unit.as_str(), series.parameter.name.as_str()), ("°C", "heartbeat.temp"));
    series.samples
}

both!(few_values_come_as_they_are);
async fn few_values_come_as_they_are(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    store_values(&store, &[(30, None), (10, Some(1.5)), (20, Some(-2.0))]).await;
    let sample = |at_us, value| Sample { at_us, value, frame: 1 };
    let all = ask(&store, i64::MIN, i64::MAX, 3).await;
    assert_eq!(all, Samples::Raw(vec![sample(10, Some(1.5)), sample(20, Some(-2.0)), sample(30, None)]));
    assert_eq!(ask(&store, 11, 30, 3).await, Samples::Raw(vec![sample(20, Some(-2.0))]));
    assert_eq!(ask(&store, 31, 90, 3).await, Samples::Raw(vec![]));
}

both!(many_values_come_in_buckets_that_miss_none);
async fn many_values_come_in_buckets_that_miss_none(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let values: Vec<(i64, Option<f64>)> = (0..1000)
        .map(|i| (i * 10, (i % 100 != 7).then_some(if i == 503 { 99.0 } else { f64::from(i as i32 % 10) })))
        .collect();
    store_values(&store, &values).await;
    let Samples::Buckets(buckets) = ask(&store, i64::MIN, i64::MAX, 100).await else { panic!("raw") };
    assert!(buckets.len() <= 100 && buckets.len() > 90, "{}", buckets.len());
    assert_eq!(buckets.iter().map(|b| b.count).sum::<i64>(), 990);
    assert_eq!(buckets.iter().map(|b| b.invalid).sum::<i64>(), 10);
    assert_eq!(buckets.iter().filter(|b| b.max == Some(99.0)).count(), 1, "the spike is not thinned away");
    for bucket in &buckets {
        let inside: Vec<f64> = values
            .iter()
            .filter(|(at, _)| (bucket.start_us..bucket.stop_us).contains(at))
            .filter_map(|(_, value)| *value)
            .collect();
        assert_eq!(inside.len() as i64, bucket.count);
        assert_eq!(bucket.min, inside.iter().copied().reduce(f64::min));
        assert_eq!(bucket.max, inside.iter().copied().reduce(f64::max));
        let mean = inside.iter().sum::<f64>() / inside.len() as f64;
        assert!((bucket.mean.unwrap() - mean).abs() < 1e-9);
        assert!(bucket.last.at_us < bucket.stop_us && bucket.last.at_us >= bucket.stop_us - 20);
    }
    assert!(buckets.windows(2).all(|pair| pair[0].stop_us <= pair[1].start_us));
    let Samples::Buckets(one) = ask(&store, i64::MIN, i64::MAX, 1).await else { panic!("raw") };
    assert_eq!((one.len(), one[0].count), (1, 990));
}

both!(the_newest_value_of_each_parameter);
async fn the_newest_value_of_each_parameter(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    for id in [1, 2, 3] {
        store.apply(&batch(heard(id))).await.unwrap();
    }
    let latest = store.latest("pixelsat-1").await.unwrap();
    assert_eq!(latest.len(), 29);
    assert!(latest.iter().all(|value| value.sample.frame == 3));
    let find = |name: &str| latest.iter().find(|value| value.parameter.name == name).unwrap();
    assert_eq!(find("heartbeat.uptime").sample.value, Some(3000.0));
    assert_eq!(find("heartbeat.accel.x").sample.value, None, "NaN is invalid, but there");
    assert_eq!(find("heartbeat.accel.z").sample.value, Some(f64::from(f32::MAX)));
    assert_eq!(store.latest("nobody").await.unwrap(), []);
    let query = TelemetryQuery {
        satellite: "pixelsat-1".into(),
        parameter: "heartbeat.nonsense".into(),
        start_us: 0,
        stop_us: 1,
        max_points: 0,
    };
    assert_eq!(store.telemetry(&query).await.unwrap(), None);
}

/// A year of one value every 30 s, and how long a plot of it takes, for docs/storage.md.
#[tokio::test]
#[ignore = "a figure, not a check"]
async fn figure_a_year_of_one_parameter() {
    let (_parent, store) = fresh(Kind::Lite).await;
    store_values(&store, &[]).await;
    for day in 0..365 {
        let frame = frame_of(day + 2, &protocol::Downlink::Pong, &route());
        let id = frame.id;
        let mut records = vec![Record::Frame(frame)];
        records.extend((0..2880).map(|i| {
            Record::Telemetry(TelemetryRecord {
                frame: id,
                route: route(),
                at: UtcUs((day as i64 * 2880 + i) * 30_000_000),
                decoder_version: 1,
                points: vec![Point {
                    parameter: "heartbeat.temp".into(),
                    unit: "°C",
                    value: Some(i as f64 / 7.0),
                }],
            })
        }));
        store.apply(&batch(records)).await.unwrap();
    }
    #[expect(clippy::disallowed_methods, reason = "a stopwatch on the real disk")]
    let begun = std::time::Instant::now();
    let Samples::Buckets(buckets) = ask(&store, i64::MIN, i64::MAX, 1000).await else { panic!("raw") };
    println!("{} buckets of {} values in {:?}", buckets.len(), 365 * 2880, begun.elapsed());
}
