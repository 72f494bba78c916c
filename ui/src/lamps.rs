//! The pieces of the top bar: countdown, clock, lamps, alarm counts, the hatch of a simulation. Each is as wide for
//! every state as for its widest, so that nothing beside it moves.

use egui::{
    Align2, Color32, FontId, Painter, Pos2, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo,
    pos2, vec2,
};
use jiff::{SignedDuration, Timestamp};

use crate::level::{Level, paint_shape};
use crate::theme::{Theme, sizes};
use crate::{fonts, format};

/// When the satellite rises and sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PassTimes {
    /// Rise above the horizon.
    pub aos: Timestamp,
    /// Set below it.
    pub los: Timestamp,
}

/// What the countdown reads: `AOS −00:04:12` before the pass, `LOS −00:02:10` in it, `LOS +00:02:10` after it.
#[must_use]
pub fn countdown_text(now: Timestamp, pass: Option<PassTimes>) -> String {
    match pass {
        None => format!("AOS {}", format::UNKNOWN),
        Some(pass) if now < pass.aos => format!("AOS {}", format::countdown(pass.aos, now)),
        Some(pass) => format!("LOS {}", format::countdown(pass.los, now)),
    }
}

/// The countdown to the next pass or to the end of this one, over a thin bar that fills as the pass goes by.
pub fn countdown(ui: &mut Ui, now: Timestamp, pass: Option<PassTimes>) -> Response {
    let theme = Theme::current(ui);
    let text = countdown_text(now, pass);
    let face = fonts::figures(sizes().large);
    let widest = width(ui, "AOS −00:00:00", &face);
    let (rect, response) = ui.allocate_exact_size(vec2(widest, sizes().large + 10.0), Sense::hover());
    if ui.is_rect_visible(rect) {
        let painter = ui.painter();
        let in_pass = pass.is_some_and(|pass| pass.aos <= now && now < pass.los);
        let colour = if in_pass { theme.accent } else { theme.text };
        let (event, time) = text.split_once(' ').unwrap_or((&text, ""));
        let top = rect.left_top();
        let baseline = top.y + (sizes().large + 4.0) / 2.0;
        // A countdown of days is longer than the place: it is written smaller, not cut
        let fits = text.chars().count() <= 13;
        let time_face = if fits { face.clone() } else { fonts::figures(sizes().title) };
        painter.text(
            pos2(rect.left(), baseline),
            Align2::LEFT_CENTER,
            event,
            face,
            if in_pass { theme.text } else { theme.dim },
        );
        painter.text(pos2(rect.right(), baseline), Align2::RIGHT_CENTER, time, time_face, colour);
        let bar = Rect::from_min_max(pos2(rect.left(), rect.bottom() - 3.0), rect.right_bottom());
        painter.rect_filled(bar, 1.5, theme.line);
        if let Some(pass) = pass {
            let part = part_of(pass, now);
            if part > 0.0 {
                let done = Rect::from_min_size(bar.min, vec2(bar.width() * part, bar.height()));
                painter.rect_filled(done, 1.5, if in_pass { theme.accent } else { theme.faint });
            }
        }
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Timer, true, &text));
    match pass {
        Some(pass) => response.on_hover_text(format!(
            "AOS {}\nLOS {}\n{} long",
            format::utc(pass.aos),
            format::utc(pass.los),
            format::length(pass.los.duration_since(pass.aos))
        )),
        None => response.on_hover_text("No pass is known: are there elements for this satellite?"),
    }
}

/// How much of the pass has gone by, 0 to 1.
fn part_of(pass: PassTimes, now: Timestamp) -> f32 {
    let whole = pass.los.duration_since(pass.aos).as_secs_f32();
    if whole > 0.0 { (now.duration_since(pass.aos).as_secs_f32() / whole).clamp(0.0, 1.0) } else { 0.0 }
}

/// The clock: UTC with the date, or with the day of the year; a click changes from one to the other.
pub fn utc_clock(ui: &mut Ui, now: Timestamp, day_of_year: &mut bool) -> Response {
    let theme = Theme::current(ui);
    let face = fonts::figures(sizes().title);
    let widest = width(ui, "2026-11-22T00:00:00Z", &face);
    let (rect, response) = ui.allocate_exact_size(vec2(widest, ui.spacing().interact_size.y), Sense::click());
    if response.clicked() {
        *day_of_year = !*day_of_year;
    }
    let text = if *day_of_year { format::utc_day_of_year(now) } else { format::utc(now) };
    if ui.is_rect_visible(rect) {
        let (date, time) = text.split_once('T').unwrap_or((&text, ""));
        let painter = ui.painter();
        let drawn = painter.text(rect.right_center(), Align2::RIGHT_CENTER, time, face.clone(), theme.text);
        let t = painter.text(drawn.left_center(), Align2::RIGHT_CENTER, "T", face.clone(), theme.faint);
        painter.text(t.left_center(), Align2::RIGHT_CENTER, date, face, theme.dim);
        focus_ring(ui, rect, &response);
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("UTC clock {text}")));
    response.on_hover_text("Coordinated Universal Time. Click: the day of the year instead of the date")
}

/// How a link is: the words that Yamcs uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Link {
    /// It works.
    Ok,
    /// It works, and nothing is expected now.
    Quiet,
    /// It cannot be reached and is tried again.
    Unavailable,
    /// Somebody switched it off.
    Disabled,
    /// It ended with an error.
    Failed,
}

impl Link {
    /// Its word.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Quiet => "quiet",
            Self::Unavailable => "unavailable",
            Self::Disabled => "disabled",
            Self::Failed => "failed",
        }
    }

    fn colour(self, theme: &Theme) -> Color32 {
        match self {
            Self::Ok => theme.accent,
            Self::Quiet | Self::Disabled => theme.faint,
            Self::Unavailable => theme.distress,
            Self::Failed => theme.critical,
        }
    }
}

/// A lamp for a link with the age of the last frame. A filled dot works, a ring is quiet or off, a diamond cannot be
/// reached, a cross has failed.
pub fn link_lamp(ui: &mut Ui, name: &str, link: Link, last_frame: Option<SignedDuration>) -> Response {
    let theme = Theme::current(ui);
    let age = last_frame.map_or(format::UNKNOWN.into(), format::age);
    let name_width = width(ui, name, &fonts::body());
    let age_width = width(ui, "unavailable", &fonts::small_figures());
    let size = vec2(18.0 + name_width + 8.0 + age_width, ui.spacing().interact_size.y);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    if ui.is_rect_visible(rect) {
        let painter = ui.painter();
        paint_link(painter, rect.left_center() + vec2(6.0, 0.0), link, theme);
        let name_at = rect.left_center() + vec2(18.0, 0.0);
        painter.text(name_at, Align2::LEFT_CENTER, name, fonts::body(), theme.text);
        // What works shows its age; what does not says so
        let works = matches!(link, Link::Ok | Link::Quiet);
        painter.text(
            name_at + vec2(name_width + 8.0, 0.0),
            Align2::LEFT_CENTER,
            if works { age.as_str() } else { link.word() },
            fonts::small_figures(),
            if works { theme.dim } else { link.colour(theme) },
        );
    }
    let told = format!("{name}: {}, last frame {age} ago", link.word());
    response.widget_info(|| WidgetInfo::labeled(Role::Status, true, &told));
    response.on_hover_text(told)
}

fn paint_link(painter: &Painter, centre: Pos2, link: Link, theme: &Theme) {
    let colour = link.colour(theme);
    let stroke = Stroke::new(1.5, colour);
    match link {
        Link::Ok => {
            painter.circle_filled(centre, 5.0, colour);
        }
        Link::Quiet => {
            painter.circle_stroke(centre, 4.5, stroke);
        }
        Link::Disabled => {
            painter.circle_stroke(centre, 4.5, stroke);
            painter.line_segment([centre + vec2(-3.0, 3.0), centre + vec2(3.0, -3.0)], stroke);
        }
        Link::Unavailable => paint_shape(painter, centre, 13.0, Level::Distress, colour),
        Link::Failed => {
            painter.line_segment([centre + vec2(-4.0, -4.0), centre + vec2(4.0, 4.0)], stroke);
            painter.line_segment([centre + vec2(-4.0, 4.0), centre + vec2(4.0, -4.0)], stroke);
        }
    }
}

/// What the transmitter of the ground station can do now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Transmitter {
    /// Nothing can go out.
    Safe,
    /// It may go on the air at any time.
    Armed,
    /// It radiates now.
    OnAir,
    /// The server did not say, or its word is old.
    Unknown,
}

impl Transmitter {
    /// The word on the lamp.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Safe => "SAFE",
            Self::Armed => "ARMED",
            Self::OnAir => "ON AIR",
            Self::Unknown => "TX ?",
        }
    }
}

/// The most important lamp on the screen: an outline with SAFE or ARMED, filled with ON AIR.
pub fn transmitter_lamp(ui: &mut Ui, transmitter: Transmitter) -> Response {
    let theme = Theme::current(ui);
    let face = fonts::figures(sizes().body);
    let size = vec2(width(ui, "ON AIR", &face) + 24.0, 28.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    if ui.is_rect_visible(rect) {
        let (fill, edge, word) = match transmitter {
            Transmitter::Safe => (Color32::TRANSPARENT, theme.safe, theme.dim),
            Transmitter::Armed => (Color32::TRANSPARENT, theme.armed, theme.armed),
            Transmitter::OnAir => (theme.on_air, theme.on_air, theme.on_air_text),
            Transmitter::Unknown => (Color32::TRANSPARENT, theme.line, theme.dim),
        };
        let painter = ui.painter();
        painter.rect(rect, 4.0, fill, Stroke::new(2.0, edge), StrokeKind::Inside);
        painter.text(rect.center(), Align2::CENTER_CENTER, transmitter.word(), face, word);
    }
    let told = format!("Transmitter {}", transmitter.word());
    response.widget_info(|| WidgetInfo::labeled(Role::Status, true, &told));
    response.on_hover_text(match transmitter {
        Transmitter::Safe => "The transmitter of the ground station cannot go on the air",
        Transmitter::Armed => "The transmitter of the ground station may go on the air at any time",
        Transmitter::OnAir => "The ground station transmits now",
        Transmitter::Unknown => "The server did not say what the transmitter does",
    })
}

/// How many alarms there are of each level, watch first; returns the level that was clicked.
pub fn alarm_counts(ui: &mut Ui, counts: [usize; 5]) -> Option<Level> {
    let theme = Theme::current(ui);
    let face = fonts::small_figures();
    let slot = vec2(18.0 + width(ui, "99", &face) + 6.0, ui.spacing().interact_size.y);
    let mut clicked = None;
    ui.spacing_mut().item_spacing.x = 0.0;
    ui.horizontal(|ui| {
        for (level, count) in Level::ALL.into_iter().zip(counts) {
            let (rect, response) = ui.allocate_exact_size(slot, Sense::click());
            if response.clicked() {
                clicked = Some(level);
            }
            if ui.is_rect_visible(rect) {
                let colour = if count == 0 { theme.faint } else { level.colour(theme) };
                let painter = ui.painter();
                if response.hovered() {
                    painter.rect_filled(rect, 4.0, theme.raised);
                }
                paint_shape(painter, rect.left_center() + vec2(10.0, 0.0), 13.0, level, colour);
                let text = if count > 99 { "99+".into() } else { count.to_string() };
                painter.text(
                    rect.left_center() + vec2(20.0, 0.0),
                    Align2::LEFT_CENTER,
                    text,
                    face.clone(),
                    if count == 0 { theme.dim } else { theme.text },
                );
                focus_ring(ui, rect, &response);
            }
            let told = format!("{count} {}", level.word());
            response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &told));
            response.on_hover_text(format!("{told}: show them"));
        }
    });
    clicked
}

/// Hatches what lies behind the top bar of a simulation: paint it first, then the bar over it.
pub fn simulated_hatch(painter: &Painter, rect: Rect, theme: &Theme) {
    let painter = painter.with_clip_rect(painter.clip_rect().intersect(rect));
    let stroke = Stroke::new(6.0, theme.line.gamma_multiply(0.6));
    let (step, height) = (18.0, rect.height());
    let mut x = rect.left() - height - step;
    while x < rect.right() + step {
        painter
            .line_segment([pos2(x, rect.bottom() + 4.0), pos2(x + height + 8.0, rect.top() - 4.0)], stroke);
        x += step;
    }
}

/// The word SIMULATED on a plate of its own, so that the hatch does not run through it.
pub fn simulated_word(ui: &mut Ui) -> Response {
    let theme = Theme::current(ui);
    let face = fonts::figures(sizes().body);
    let size = vec2(width(ui, "SIMULATED", &face) + 16.0, 24.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let painter = ui.painter();
    painter.rect(rect, 4.0, theme.panel, Stroke::new(1.0, theme.dim), StrokeKind::Inside);
    painter.text(rect.center(), Align2::CENTER_CENTER, "SIMULATED", face, theme.text);
    response.widget_info(|| WidgetInfo::labeled(Role::Status, true, "SIMULATED"));
    response.on_hover_text("A digital twin answers here, not the satellite")
}

/// How the app stands with its server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Connection {
    /// Live.
    Live {
        /// Where, without any token.
        server: String,
        /// As whom.
        person: String,
    },
    /// Not yet, or not any more; everything shown is old since then.
    Lost {
        /// Where, without any token.
        server: String,
        /// Since when nothing came.
        since: Option<SignedDuration>,
        /// In how long the next attempt is made.
        next_try: Option<SignedDuration>,
    },
    /// The server speaks and turns us away: a wrong token, another version.
    Refused {
        /// Where, without any token.
        server: String,
        /// Why, in one line.
        why: String,
    },
}

impl Connection {
    /// The line that is shown.
    #[must_use]
    pub fn text(&self) -> String {
        match self {
            Self::Live { server, person } => format!("{person} at {server}"),
            Self::Lost { server, since, next_try } => {
                let since = since.map_or(String::new(), |since| format!(" for {}", format::age(since)));
                let next =
                    next_try.map_or(String::new(), |next| format!(", next try in {}", format::age(next)));
                format!("{server} not reached{since}{next}")
            }
            Self::Refused { server, why } => format!("{server} refused: {why}"),
        }
    }
}

/// Who is connected, or that nobody is.
pub fn connection(ui: &mut Ui, connection: &Connection) -> Response {
    let theme = Theme::current(ui);
    let link = match connection {
        Connection::Live { .. } => Link::Ok,
        Connection::Lost { .. } => Link::Unavailable,
        Connection::Refused { .. } => Link::Failed,
    };
    let text = connection.text();
    let colour = if link == Link::Ok { theme.dim } else { theme.text };
    let galley = ui.painter().layout_no_wrap(text.clone(), fonts::body(), colour);
    let size = vec2(16.0 + galley.size().x, ui.spacing().interact_size.y);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    if ui.is_rect_visible(rect) {
        let painter = ui.painter();
        paint_link(painter, rect.left_center() + vec2(6.0, 0.0), link, theme);
        painter.galley(pos2(rect.left() + 16.0, rect.center().y - galley.size().y / 2.0), galley, colour);
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Status, true, &text));
    response
}

/// How wide a text is in a face, points.
pub(crate) fn width(ui: &Ui, text: &str, face: &FontId) -> f32 {
    ui.painter().layout_no_wrap(text.to_owned(), face.clone(), Color32::PLACEHOLDER).size().x
}

/// A ring in the accent colour round what has the keyboard.
pub(crate) fn focus_ring(ui: &Ui, rect: Rect, response: &Response) {
    if response.has_focus() {
        let accent = Theme::current(ui).accent;
        ui.painter().rect_stroke(rect.expand(2.0), 4.0, Stroke::new(1.5, accent), StrokeKind::Inside);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_countdown_speaks_of_what_comes_next() {
        let pass = Some(PassTimes {
            aos: "2026-11-22T14:00:00Z".parse().unwrap(),
            los: "2026-11-22T14:10:00Z".parse().unwrap(),
        });
        let read = |now: &str| countdown_text(now.parse().unwrap(), pass);
        assert_eq!(read("2026-11-22T13:55:48Z"), "AOS −00:04:12");
        assert_eq!(read("2026-11-22T14:00:00Z"), "LOS −00:10:00");
        assert_eq!(read("2026-11-22T14:12:10Z"), "LOS +00:02:10");
        assert_eq!(countdown_text(Timestamp::UNIX_EPOCH, None), "AOS –");
    }
}
