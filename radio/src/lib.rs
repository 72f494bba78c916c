//! The Ebyte E22-400T30D radio module, seen from the host's serial port.
//!
//! | module | what it holds |
//! |---|---|
//! | [`airtime`] | how long a packet occupies the air, and a byte the UART |
//! | [`registers`] | the module's configuration block, bit by bit |
//! | [`command`] | what the host writes in configuration mode |
//! | [`reply`] | what the module answers: scanners that survive junk, echoes and missing line ends |
//! | [`driver`] | the state machine that brings a module up, sends one frame at a time and delivers what is heard |
//! | [`model`] | the module itself in virtual time, with its faults, to test the driver and to stand behind a twin |
//!
//! Nothing here opens a port, reads a clock or draws a random number. Time is a `u64` in microseconds on one
//! monotonic scale (suffix `_us`); bytes go in, bytes and events come out. The shell maps the modem lines, owns the
//! port and sleeps until [`driver::Driver::next_wakeup_us`].
//!
//! What it does **not** do: find frames in the received bytes (`protocol::stream` does, RSSI byte included), decide
//! when to send (the mission's link discipline does), or tune for Doppler (the module cannot).
//!
//! ```
//! use radio::airtime::{LoraPhy, uart_us};
//! // A full frame takes about a quarter of a second on the wire and 1.2 s on the air.
//! assert_eq!(uart_us(243, 9600), 253_125);
//! assert_eq!(LoraPhy::LIKELY_2K4.time_on_air_us(240), 1_229_824);
//! ```

pub mod airtime;
pub mod command;
pub mod driver;
pub mod model;
pub mod registers;
pub mod reply;
