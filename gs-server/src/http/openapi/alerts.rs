//! What the document says about alerts.

use api::ProblemKind as K;
use api::{AlertNote, AlertView, AssignRequest, Nothing, ShelveRequest, TargetTested, TargetView};

use super::operation::{Doc, Kind, get, param, post};
use super::table::{AFTER, BEFORE, FROM, INTENT, LIMIT, UNTIL};

pub(super) fn alerts() -> Vec<Doc> {
    vec![
        get("/api/v1/alerts", "alerts", "list_alerts", "What should not be, or the history of it")
            .query(&[
                param("state", Kind::OneOf(&["open", "closed", "all"]), "`open` when left out."),
                param("satellite", Kind::Text, "Only of this satellite."),
                param(
                    "level",
                    Kind::OneOf(&["normal", "watch", "warning", "distress", "critical", "severe"]),
                    "Only what was at least this grave.",
                ),
                FROM,
                UNTIL,
                AFTER,
                BEFORE,
                LIMIT,
            ])
            .page::<AlertView>(),
        get("/api/v1/alerts/targets", "alerts", "list_targets", "Where messages go, and whether they arrive")
            .page::<TargetView>(),
        post("/api/v1/alerts/targets/{name}/test", "alerts", "test_target", "Send a test message, once")
            .body::<Nothing>()
            .json::<TargetTested>()
            .problems(&[K::UnknownTarget, K::DeliveryFailed, K::Overloaded]),
        get("/api/v1/alerts/{id}", "alerts", "get_alert", "One alert")
            .json::<AlertView>()
            .problems(&[K::NotFound]),
        post("/api/v1/alerts/{id}/acknowledge", "alerts", "acknowledge_alert", "Take note of it")
            .body::<AlertNote>()
            .json::<AlertView>()
            .problems(&INTENT)
            .problems(&[K::NotFound, K::AlertNotOpen, K::BadArgument]),
        post("/api/v1/alerts/{id}/shelve", "alerts", "shelve_alert", "Put it aside: nobody is told")
            .body::<ShelveRequest>()
            .json::<AlertView>()
            .problems(&INTENT)
            .problems(&[K::NotFound, K::AlertNotOpen, K::BadArgument]),
        post("/api/v1/alerts/{id}/unshelve", "alerts", "unshelve_alert", "Take it off its shelf")
            .body::<AlertNote>()
            .json::<AlertView>()
            .problems(&INTENT)
            .problems(&[K::NotFound, K::AlertNotOpen, K::BadArgument]),
        post("/api/v1/alerts/{id}/assign", "alerts", "assign_alert", "Give it to somebody")
            .body::<AssignRequest>()
            .json::<AlertView>()
            .problems(&INTENT)
            .problems(&[K::NotFound, K::AlertNotOpen, K::BadArgument]),
    ]
}
