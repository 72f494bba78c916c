//! The real engine over a day of passes, watched for alarms: outside a pass silence is normal, in one it is not.

use std::collections::BTreeMap;

use mission::alert::{Alert, AlertKind, Alerts, PassSeen, Policy, Surroundings, judge};
use mission::{Input, LinkId, LinkState, Record};

use crate::sky::{add, elements, site};
use crate::world::{S, Setup, UTC0, World};

const DAY: u64 = 86_400 * S;
const LOOK: u64 = 2 * S;

struct Watch {
    world: World,
    alerts: Alerts,
    around: Surroundings,
    period_us: u64,
    /// Every alert that ever was, by number, as it was last.
    all: BTreeMap<u64, Alert>,
}

impl Watch {
    fn new() -> Self {
        let mut world = World::new(Setup { site: Some(site()), ..Setup::default() });
        world.link_state(LinkState::Ok);
        let file = LinkId::new("file").unwrap();
        world.handle(Input::Link { link: &file, state: LinkState::Ok });
        add(&mut world, vec![elements(UTC0, 0.0)]).unwrap();
        let period_us = world.setup.profile.heartbeat_period_us;
        let around = Surroundings {
            heartbeat_period_us: [(world.satellite.clone(), period_us)].into(),
            has_site: true,
            clock_is_right: Some(true),
            disk_free_percent: Some(50.0),
            ..Surroundings::default()
        };
        let alerts = Alerts::new(Policy::default(), Vec::new(), 0, world.now);
        Self { world, alerts, around, period_us, all: BTreeMap::new() }
    }

    /// So long, heard in view as `hears` says: by the number of the pass and the beat in it.
    fn watch(&mut self, us: u64, hears: impl Fn(usize, u64) -> bool) {
        let end = self.world.now.mono.plus(us);
        let (mut pass, mut since, mut beats) = (0, None, 0);
        while self.world.now.mono < end {
            self.world.pass(LOOK);
            let status = self.world.station.status(self.world.now);
            let in_view = status.satellites[0].in_view == Some(true);
            match (since, in_view) {
                (None, true) => (since, pass, beats) = (Some(self.world.now.mono), pass + 1, 0),
                (Some(_), false) => since = None,
                _ => {}
            }
            if let Some(since) = since
                && self.world.now.mono.since(since) >= beats * self.period_us
            {
                beats += 1;
                if hears(pass, beats) {
                    self.world.heartbeat();
                }
            }
            self.look();
        }
    }

    fn look(&mut self) {
        let stored = self.world.stored.iter().filter_map(|record| match record {
            Record::Pass(pass) => Some(PassSeen {
                satellite: pass.satellite.clone(),
                aos_at: pass.aos_at,
                los_at: pass.ended_at?,
                max_elevation_deg: pass.max_elevation_deg,
            }),
            _ => None,
        });
        self.around.passes = stored.collect();
        let status = self.world.station.status(self.world.now);
        let found = judge(&status, &self.around, &self.alerts.policy().thresholds, self.world.now.utc);
        for alert in self.alerts.observe(self.world.now, &found).alerts {
            self.all.insert(alert.id.0, alert);
        }
    }
}

#[test]
fn a_day_of_gaps_between_passes_raises_nothing() {
    let mut watch = Watch::new();
    watch.watch(DAY, |_, _| true);
    let passes = watch.around.passes.len();
    assert!(passes >= 4, "{passes} passes");
    assert_eq!(watch.all.values().map(|alert| alert.message.as_str()).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn a_beacon_that_stops_in_view_is_an_alert_within_two_intervals() {
    let mut watch = Watch::new();
    // Three beats of the first pass that is high enough, then silence until its end.
    watch.watch(DAY / 2, |_, beat| beat <= 3);
    let alerts: Vec<&Alert> = watch.all.values().filter(|alert| alert.kind == AlertKind::Beacon).collect();
    let heard = watch.world.station.status(watch.world.now).satellites[0].heard_at.unwrap();
    assert!(!alerts.is_empty());
    let late = alerts.iter().map(|alert| {
        let pass = watch.around.passes.iter().rev().find(|pass| pass.aos_at < alert.raised_at).unwrap();
        assert!(alert.raised_at < pass.los_at, "in view");
        assert!(
            !alert.active && alert.returned_at.unwrap().0 <= pass.los_at.0 + 2_000_000,
            "it ends with the pass"
        );
        alert.message.clone()
    });
    assert!(late.clone().all(|message| message.contains("overdue by")), "{:?}", late.collect::<Vec<_>>());
    // Of the last pass that was heard: from its last beat on.
    let last = alerts.last().unwrap();
    assert!(last.times >= 1 && last.changed_at > heard);
    let first = alerts.first().unwrap();
    let pass = watch.around.passes.iter().find(|pass| pass.los_at > first.raised_at).unwrap();
    let period = i64::try_from(watch.period_us).unwrap();
    let last_beat = pass.aos_at.0 + 2 * period;
    let late = first.raised_at.0 - last_beat;
    assert!((period..=2 * period + 6_000_000).contains(&late), "{} s after the last beat", late / 1_000_000);
}

#[test]
fn pass_after_pass_without_a_frame_is_told_once_and_gets_worse() {
    let mut watch = Watch::new();
    watch.watch(2 * DAY, |_, _| false);
    let silent: Vec<&Alert> = watch.all.values().filter(|alert| alert.kind == AlertKind::Silent).collect();
    assert_eq!(silent.len(), 1, "{silent:?}");
    assert_eq!(silent[0].worst, mission::Level::Critical);
    assert!(silent[0].active);
    let low = |pass: &&PassSeen| pass.max_elevation_deg >= 10.0;
    let second = watch.around.passes.iter().filter(low).nth(1).unwrap();
    assert!((0..4_000_000).contains(&(silent[0].raised_at.0 - second.los_at.0)), "with the second LOS");
}

#[test]
fn a_link_that_is_gone_and_elements_that_age_are_alerts() {
    let mut watch = Watch::new();
    watch.world.link_state(LinkState::Unavailable { reason: "unplugged".to_owned() });
    watch.watch(60 * S, |_, _| true);
    let kinds: Vec<AlertKind> = watch.all.values().map(|alert| alert.kind).collect();
    assert_eq!(kinds, [AlertKind::Link]);
    watch.world.link_state(LinkState::Ok);
    watch.watch(120 * S, |_, _| true);
    assert!(!watch.all[&1].active);
    watch.world.pass(8 * DAY);
    watch.world.heartbeat();
    // For so long they may be on their way.
    watch.watch(150 * S, |_, _| true);
    assert!(
        watch.all.values().any(|alert| alert.kind == AlertKind::Elements && alert.active),
        "{:?}",
        watch.all
    );
}
