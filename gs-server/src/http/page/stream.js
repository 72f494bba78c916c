// The one stream: events in order, each once, and the status. It comes back by itself.

const WAITS_MS = [500, 1000, 2000, 4000, 8000];
// The server says something at least every second; longer silence means that the line is dead.
const SILENCE_MS = 12000;

/**
 * @param {{event: Function, status: Function, open: Function, away: Function, reset: Function}} to
 */
export function follow(after, to) {
  let last = after;
  let failures = 0;
  let heard = 0;
  let socket = null;

  const connect = () => {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const opened = new WebSocket(`${scheme}://${location.host}/api/v1/stream?after=${last}`);
    socket = opened;
    heard = performance.now();
    opened.onmessage = ({ data }) => {
      heard = performance.now();
      const message = JSON.parse(data);
      if (message.type === "hello") {
        failures = 0;
        if (message.reset) {
          last = message.after;
          to.reset();
        }
        to.open();
      } else if (message.type === "event") {
        if (message.sequence <= last) return;
        last = message.sequence;
        to.event(message);
      } else if (message.type === "status") {
        to.status(message);
      }
    };
    opened.onclose = () => {
      if (socket !== opened) return;
      socket = null;
      const wait = WAITS_MS[Math.min(failures, WAITS_MS.length - 1)];
      failures += 1;
      to.away(wait);
      setTimeout(connect, wait);
    };
  };

  setInterval(() => {
    if (socket && performance.now() - heard > SILENCE_MS) socket.close();
  }, 2000);
  connect();
}
