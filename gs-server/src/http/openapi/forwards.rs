//! What the document says about passing on.

use api::ProblemKind as K;
use api::{ForwardTargetView, ForwardView, ForwardWhole, Nothing};

use super::operation::{Doc, Kind, get, param, post};
use super::table::{AFTER, BEFORE, FROM, LIMIT, UNTIL};

pub(super) fn forwards() -> Vec<Doc> {
    let states = Kind::OneOf(&["waiting", "sending", "sent", "unknown", "refused", "dry"]);
    vec![
        get("/api/v1/forwards", "archive", "list_forwards", "What is passed on to others, and how it stands")
            .query(&[
                param("target", Kind::Text, "Only to this target."),
                param("state", states, "Only in this state."),
                FROM,
                UNTIL,
                AFTER,
                BEFORE,
                LIMIT,
            ])
            .page::<ForwardView>(),
        get("/api/v1/forwards/targets", "archive", "list_forward_targets", "To whom, and whether it arrives")
            .page::<ForwardTargetView>(),
        post("/api/v1/forwards/targets/{name}/pause", "archive", "pause_forwards", "Send nothing for now")
            .body::<Nothing>()
            .json::<ForwardTargetView>()
            .problems(&[K::UnknownTarget]),
        post("/api/v1/forwards/targets/{name}/resume", "archive", "resume_forwards", "Send on")
            .body::<Nothing>()
            .json::<ForwardTargetView>()
            .problems(&[K::UnknownTarget]),
        get("/api/v1/forwards/{id}", "archive", "get_forward", "One of them, with the exact request")
            .json::<ForwardWhole>()
            .problems(&[K::NotFound]),
        post(
            "/api/v1/forwards/{id}/retry",
            "archive",
            "retry_forward",
            "Send again what is unknown, refused or of a dry run",
        )
        .body::<Nothing>()
        .json::<ForwardView>()
        .problems(&[K::NotFound, K::TooLate]),
    ]
}
