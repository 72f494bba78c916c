// Times, ages and numbers as people read them. All times are UTC.

const two = (n) => String(n).padStart(2, "0");

/** `05:19:25` */
export const clock = (ms) => {
  const d = new Date(ms);
  return `${two(d.getUTCHours())}:${two(d.getUTCMinutes())}:${two(d.getUTCSeconds())}`;
};

/** `2026-11-22 UTC` */
export const date = (ms) => `${new Date(ms).toISOString().slice(0, 10)} UTC`;

/** Milliseconds of a time on the wire; null stays null. */
export const ms = (text) => (text === null || text === undefined ? null : Date.parse(text));

/** `12 s`, `4 min 05 s`, `3 h 12 min`, `5 d 2 h` */
export function span(duration) {
  const s = Math.max(0, Math.floor(duration / 1000));
  if (s < 60) return `${s} s`;
  if (s < 3600) return `${Math.floor(s / 60)} min ${two(s % 60)} s`;
  if (s < 86400) return `${Math.floor(s / 3600)} h ${two(Math.floor((s % 3600) / 60))} min`;
  return `${Math.floor(s / 86400)} d ${Math.floor((s % 86400) / 3600)} h`;
}

/** A number with a fixed width of digits; `invalid` for what a failed sensor sent. */
export function number(value, digits = 2) {
  if (value === null || value === undefined) return "invalid";
  if (Math.abs(value) >= 1e6) return value.toExponential(2);
  return value.toFixed(digits);
}

/** `00:04:12`, `2 d 03:04:05` */
export function countdown(duration) {
  const s = Math.max(0, Math.ceil(duration / 1000));
  const days = Math.floor(s / 86400);
  const time = `${two(Math.floor(s / 3600) % 24)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`;
  return days > 0 ? `${days} d ${time}` : time;
}

const WINDS = ["N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW"];

/** An azimuth as the wind it comes from: `NNE` */
export const wind = (degrees) => WINDS[Math.round((((degrees % 360) + 360) % 360) / 22.5) % 16];
