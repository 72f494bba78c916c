//! What reports count, on both databases.

use mission::record::{EventKind, EventRecord, PassRecord, Record};
use mission::{Level, PassId, Stage, UtcUs};
use protocol::Telecommand;

use super::super::Span;
use super::records::*;
use super::{Kind, fresh};

const S: i64 = 1_000_000;

fn span(from_us: i64, to_us: i64) -> Span<'static> {
    Span { satellite: "pixelsat-1", station: "oslo", from_us: NOON_US + from_us, to_us: NOON_US + to_us }
}

both!(a_span_counts_what_lies_in_it);
async fn a_span_counts_what_lies_in_it(kind: Kind) {
    let (_place, store) = fresh(kind).await;
    let grave = |level, message| Record::Event(EventRecord { level, ..event(EventKind::Limit, message) });
    let mut records = [heard(1), heard(2), heard(3)].concat();
    records.extend([
        Record::Image(image(1, 1, 4)),
        Record::Chunk(chunk(1, 0, 1, 7, false)),
        Record::Chunk(chunk(1, 2, 2, 8, false)),
        Record::Chunk(chunk(1, 2, 3, 9, true)),
        Record::Command(command(1, Telecommand::Ping)),
        Record::Stage(stage(1, 0, Stage::Queued, NOON_US)),
        Record::Stage(stage(1, 1, Stage::Radiated, NOON_US + S)),
        Record::Stage(stage(1, 1, Stage::Answered, NOON_US + 2 * S)),
        Record::Command(command(2, Telecommand::Reset)),
        Record::Stage(stage(2, 1, Stage::Unknown, NOON_US + S)),
        grave(Level::Warning, "warm"),
        grave(Level::Warning, "warmer"),
        grave(Level::Severe, "hot"),
        grave(Level::Watch, "mild"),
        Record::Audit(audit("command.create")),
        Record::Pass(PassRecord {
            id: PassId(1),
            satellite: route().satellite,
            station: route().station,
            aos_at: UtcUs(NOON_US),
            tca_at: UtcUs(NOON_US + S),
            los_at: Some(UtcUs(NOON_US + 2 * S)),
            max_elevation_deg: 30.0,
            elements: Vec::new(),
            ended_at: Some(UtcUs(NOON_US + 2 * S)),
        }),
    ]);
    store.apply(&batch(records)).await.unwrap();

    // Both ends belong to it; a heartbeat is heard each second.
    let two = span(S, 2 * S);
    let frames = store.frames_in(&two).await.unwrap();
    assert_eq!(
        frames.iter().map(|heard| (heard.frame.id, heard.receptions.len())).collect::<Vec<_>>(),
        [(1, 1), (2, 1)]
    );
    let counts = store.frames_counted(&span(0, 9 * S)).await.unwrap();
    assert_eq!(counts.iter().map(|count| count.frames).sum::<i64>(), 3);
    assert!(
        counts.iter().all(|count| count.day == NOON_US / 86_400_000_000 && count.bytes > 100),
        "{counts:?}"
    );

    let commands = store.commands_in(&two, 10).await.unwrap();
    assert_eq!(
        commands.iter().map(|then| (then.command.id, then.stages.len())).collect::<Vec<_>>(),
        [(1, 3), (2, 1)]
    );
    let then = store.commands_in(&span(0, S), 1).await.unwrap();
    assert_eq!(
        (then.len(), then[0].stages.len()),
        (1, 2),
        "nothing of later, and no more than was asked for"
    );
    assert_eq!(store.commands_counted(&two).await.unwrap(), 2);
    assert_eq!(store.radiated_counted(&two).await.unwrap(), 1);
    let outcomes = store.outcomes_counted(&span(0, S)).await.unwrap();
    assert_eq!(outcomes, [("radiated".to_owned(), 1), ("unknown".to_owned(), 1)]);

    let images = store.images_in(&two).await.unwrap();
    let chunks: Vec<_> = images[0].1.iter().map(|chunk| (chunk.index, chunk.conflict)).collect();
    assert_eq!((images.len(), chunks), (1, vec![(0, false), (2, false), (2, true)]));
    assert_eq!(store.gains_counted(&span(0, 9 * S)).await.unwrap(), [1, 0, 2, 0]);

    let alarms = store.alarms_in(&span(0, 0), 2).await.unwrap();
    assert_eq!(alarms.iter().map(|row| row.message.as_str()).collect::<Vec<_>>(), ["warm", "warmer"]);
    assert_eq!(store.alarms_counted(&span(0, 0)).await.unwrap(), 3);
    assert_eq!(store.alarms_counted(&two).await.unwrap(), 0);
    assert_eq!(store.alarms_since("oslo", NOON_US, 1).await.unwrap()[0].message, "hot");
    assert_eq!(store.alarms_counted_since("oslo", NOON_US).await.unwrap(), 3);
    let mut incidents = store.incidents_counted("oslo", (NOON_US, NOON_US)).await.unwrap();
    incidents.sort_by_key(|incident| incident.count);
    let told: Vec<_> = incidents.iter().map(|one| (one.count, one.last.message.as_str())).collect();
    assert_eq!(told, [(1, "hot"), (2, "warmer")]);

    assert_eq!(store.pass(1).await.unwrap().unwrap().max_elevation_deg, 30.0);
    assert_eq!(store.pass(2).await.unwrap(), None);
    assert_eq!(store.passes_ended(5).await.unwrap().len(), 1);
    assert_eq!(store.passes_between("oslo", (NOON_US, NOON_US)).await.unwrap().len(), 1);
    assert_eq!(store.passes_between("oslo", (NOON_US + 1, NOON_US + S)).await.unwrap(), []);
    assert_eq!(store.actions_since("oslo", NOON_US, 5).await.unwrap().len(), 1);
    assert_eq!(store.runs_since("oslo", NOON_US, 5).await.unwrap(), []);
    assert_eq!(store.runs_in(&two).await.unwrap(), []);
    let unsettled = store.commands_unsettled("oslo", NOON_US, 5).await.unwrap();
    assert_eq!(unsettled.iter().map(|then| then.command.id).collect::<Vec<_>>(), [2]);
    assert_eq!(store.commands_unsettled("oslo", NOON_US + 2 * S, 5).await.unwrap(), []);
}
