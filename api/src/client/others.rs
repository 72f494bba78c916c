//! Operations about people, alerts, approvals, reports, rehearsals, and what others heard.

use super::operation::{Operation, operations};
use super::{Client, ClientError, Filter, IdempotencyKey};
use crate::{
    AlertNote, AlertView, ApprovalView, ApproveRequest, AssignRequest, EarView, ForwardTargetView,
    ForwardView, ForwardWhole, HandoverReport, ImportReport, ImportRequest, LinkMade, MonthReport, Nothing,
    Outcome, OutsideView, Page, PassReport, ReceiverView, RefuseRequest, RehearsalRequest, RehearsalView,
    SessionView, ShelveRequest, TargetTested, TargetView, TokenMade, TokenRequest, TokenView,
    TransmissionView, UserChange, UserRequest, UserView, WayView,
};

operations! { READ, read:
    /// Who asks, and what they may do.
    session -> SessionView = "session";
    /// Where messages go, and whether they arrive.
    alert_targets -> Page<TargetView> = "alerts/targets";
    /// What came in by each ear, and what was refused of it.
    ears -> Page<EarView> = "ears";
    /// Ways in over the network: how each works.
    ways -> Page<WayView> = "ears/ways";
    /// To whom receptions are passed on, and whether it arrives.
    forward_targets -> Page<ForwardTargetView> = "forwards/targets";
    /// The document of the whole API.
    openapi -> serde_json::Value = "openapi.json";
}

operations! { LIST, list:
    /// What should not be, or the history of it: `state`, `satellite`, `level`.
    alerts -> Page<AlertView> = "alerts";
    /// Who there is.
    users -> Page<UserView> = "users";
    /// Tokens of machines; never their secrets.
    tokens -> Page<TokenView> = "tokens";
    /// What waits or waited for a second person: `open`.
    approvals -> Page<ApprovalView> = "approvals";
    /// Who answered for each radiation.
    transmissions -> Page<TransmissionView> = "transmissions";
    /// Rehearsals that were asked for, newest first.
    rehearsals -> Page<RehearsalView> = "rehearsals";
    /// What others heard: `satellite`, `source`, `kind`, `original`.
    receptions -> Page<OutsideView> = "receptions";
    /// Who hears the satellite, and how one's own boards are: `satellite`.
    receivers -> Page<ReceiverView> = "receivers";
    /// What is passed on to others, and how it stands: `target`, `state`.
    forwards -> Page<ForwardView> = "forwards";
    /// What the next shift must know: `since`.
    handover -> HandoverReport = "reports/handover";
}

operations! { TEXT, text:
    /// The same as a page.
    handover_page = "reports/handover.html";
    /// The same as Markdown.
    handover_text = "reports/handover.md";
    /// The next two weeks as a calendar: `satellite`, `min_elevation`.
    calendar = "passes.ics";
    /// Sky plot (SVG) of the pass that lasts or comes next: `satellite`, `at`, `min_elevation`, `form`, `theme`.
    sky_plot = "passes/sky.svg";
    /// Passes at a glance (SVG): `satellite`, `start`, `stop`, `min_elevation`, `width`, `form`, `theme`.
    timeline_plot = "passes/timeline.svg";
}

operations! { ONE, one:
    /// One alert.
    alert(u64) -> AlertView = "alerts/{id}";
    /// One of what is passed on, with the exact request.
    forward(u64) -> ForwardWhole = "forwards/{id}";
    /// One of what waits or waited for a second person.
    approval(u64) -> ApprovalView = "approvals/{id}";
    /// How far a rehearsal is, and what it answers.
    rehearsal(u64) -> RehearsalView = "rehearsals/{id}";
    /// What a pass brought, by its number in the history of passes.
    pass_report(u64) -> PassReport = "reports/passes/{id}";
    /// What a month such as `2026-11` came to.
    month_report(&str) -> MonthReport = "reports/months/{month}";
}

operations! { ACT, act:
    /// The first administrator's one-time link, while there is no user.
    first_link -> LinkMade = "welcome/link";
}

operations! { VERB, verb:
    /// Sends a target a test message, once.
    test_target(&str) -> TargetTested = "alerts/targets/{name}/test";
    /// Passes nothing on to a target for now.
    pause_forwards(&str) -> ForwardTargetView = "forwards/targets/{name}/pause";
    /// Passes on again.
    resume_forwards(&str) -> ForwardTargetView = "forwards/targets/{name}/resume";
    /// Sends again what is unknown or refused.
    retry_forward(u64) -> ForwardView = "forwards/{id}/retry";
    /// A one-time link for somebody.
    user_link(&str) -> LinkMade = "users/{name}/link";
}

operations! { GIVE, give:
    /// Somebody new.
    add_user(UserRequest) -> UserView = "users";
    /// A token for a machine; its secret is told once.
    new_token(TokenRequest) -> TokenMade = "tokens";
    /// Sends a plan through its coming pass in simulation.
    rehearse(RehearsalRequest) -> RehearsalView = "rehearsals";
    /// Hands in what somebody heard.
    import_receptions(ImportRequest) -> ImportReport = "receptions";
}

operations! { TELL, tell:
    /// Takes note of an alert.
    acknowledge_alert(u64, AlertNote) -> AlertView = "alerts/{id}/acknowledge";
    /// Puts it aside: nobody is told.
    shelve_alert(u64, ShelveRequest) -> AlertView = "alerts/{id}/shelve";
    /// Takes it off its shelf.
    unshelve_alert(u64, AlertNote) -> AlertView = "alerts/{id}/unshelve";
    /// Gives it to somebody.
    assign_alert(u64, AssignRequest) -> AlertView = "alerts/{id}/assign";
    /// Another role, another call sign, or out.
    change_user(&str, UserChange) -> UserView = "users/{name}";
    /// Yes to exactly that; the answer is what came of it.
    approve(u64, ApproveRequest) -> Outcome = "approvals/{id}/approve";
    /// No, or never mind.
    refuse(u64, RefuseRequest) -> ApprovalView = "approvals/{id}/refuse";
}

operations! { REMOVE, remove:
    /// Takes a machine's token back.
    revoke_token(&str) -> Nothing = "tokens/{name}";
    /// Gives a rehearsal up.
    cancel_rehearsal(u64) -> RehearsalView = "rehearsals/{id}";
}

pub(super) const ALL: [&[Operation]; 9] = [READ, LIST, TEXT, ONE, ACT, VERB, GIVE, TELL, REMOVE];
