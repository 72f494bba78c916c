//! Prometheus' text form, version 0.0.4.

use std::fmt::Write as _;

use super::Reading;

/// The value of `content-type`.
pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// A page that is being written.
#[derive(Debug, Default)]
pub struct Exposition {
    text: String,
    name: &'static str,
}

/// Names and values of labels.
pub type Labels<'a> = &'a [(&'a str, &'a str)];

impl Exposition {
    /// Begins a metric that goes up and down.
    pub fn gauge(&mut self, name: &'static str, help: &str) -> &mut Self {
        self.begin(name, help, "gauge")
    }

    /// Begins a metric that only goes up.
    pub fn counter(&mut self, name: &'static str, help: &str) -> &mut Self {
        self.begin(name, help, "counter")
    }

    fn begin(&mut self, name: &'static str, help: &str, kind: &str) -> &mut Self {
        self.name = name;
        // Writing to a string does not fail.
        let _ = write!(self.text, "# HELP {name} {help}\n# TYPE {name} {kind}\n");
        self
    }

    /// A value of the metric that was begun.
    pub fn is(&mut self, labels: Labels<'_>, value: f64) -> &mut Self {
        self.line(self.name, "", labels, value);
        self
    }

    /// A value, when it is known; what is unknown is left out.
    pub fn may_be(&mut self, labels: Labels<'_>, value: Option<f64>) -> &mut Self {
        if let Some(value) = value {
            self.is(labels, value);
        }
        self
    }

    /// A whole histogram.
    pub fn histogram(&mut self, name: &'static str, help: &str, reading: &Reading) {
        self.begin(name, help, "histogram");
        for (up_to_s, count) in &reading.up_to_s {
            self.line(name, "_bucket", &[("le", &up_to_s.to_string())], *count as f64);
        }
        self.line(name, "_bucket", &[("le", "+Inf")], reading.count as f64);
        self.line(name, "_sum", &[], reading.sum_s);
        self.line(name, "_count", &[], reading.count as f64);
    }

    fn line(&mut self, name: &str, end: &str, labels: Labels<'_>, value: f64) {
        let _ = write!(self.text, "{name}{end}");
        for (at, (label, value)) in labels.iter().enumerate() {
            let before = if at == 0 { '{' } else { ',' };
            let value = value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
            let _ = write!(self.text, "{before}{label}=\"{value}\"");
        }
        if !labels.is_empty() {
            self.text.push('}');
        }
        let _ = writeln!(self.text, " {value}");
    }

    /// The page.
    #[must_use]
    pub fn finish(self) -> String {
        self.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_prometheus_text() {
        let mut page = Exposition::default();
        page.gauge("gs_a", "What.").is(&[("link", "a\"b\\c\nd"), ("x", "y")], 1.5).may_be(&[], None);
        page.counter("gs_b_total", "More.").is(&[], 7.0);
        let reading = Reading { up_to_s: vec![(0.0025, 1)], sum_s: 3.5, count: 2 };
        page.histogram("gs_c_seconds", "Long.", &reading);
        assert_eq!(
            page.finish(),
            "# HELP gs_a What.\n# TYPE gs_a gauge\ngs_a{link=\"a\\\"b\\\\c\\nd\",x=\"y\"} 1.5\n\
             # HELP gs_b_total More.\n# TYPE gs_b_total counter\ngs_b_total 7\n\
             # HELP gs_c_seconds Long.\n# TYPE gs_c_seconds histogram\n\
             gs_c_seconds_bucket{le=\"0.0025\"} 1\ngs_c_seconds_bucket{le=\"+Inf\"} 2\n\
             gs_c_seconds_sum 3.5\ngs_c_seconds_count 2\n"
        );
    }
}
