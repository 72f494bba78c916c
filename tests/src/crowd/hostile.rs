//! Clients that mean harm, each in its own way, again and again.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::follower;
use crate::wait::pause;

/// A masked frame, with a mask of zeros.
fn frame(kind: u8, content: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0x80 | kind];
    match u16::try_from(content.len()) {
        Ok(short @ 0..=125) => bytes.push(0x80 | short as u8),
        Ok(middle) => {
            bytes.push(0x80 | 126);
            bytes.extend_from_slice(&middle.to_be_bytes());
        }
        Err(_) => {
            bytes.push(0x80 | 127);
            bytes.extend_from_slice(&(content.len() as u64).to_be_bytes());
        }
    }
    bytes.extend_from_slice(&[0; 4]);
    bytes.extend_from_slice(content);
    bytes
}

/// Attacks until `stop`; how often.
pub(super) fn attack(which: usize, address: SocketAddr, stop: &AtomicBool) -> u64 {
    let mut attacks = 0;
    while !stop.load(Ordering::Acquire) {
        // A server that refuses or hangs up has done its part.
        let _ = once(which % 10, address);
        attacks += 1;
        pause(Duration::from_millis(100));
    }
    attacks
}

fn once(which: usize, address: SocketAddr) -> std::io::Result<()> {
    let stream = |content: &[u8]| -> std::io::Result<()> {
        let mut socket = follower::open(address, "events,status,frames,telemetry")?;
        socket.write_all(content)?;
        until_closed(&mut socket)
    };
    match which {
        0 => {
            let mut socket = TcpStream::connect(address)?;
            socket.write_all(&vec![0xA5; 100_000])?;
            until_closed(&mut socket)
        }
        1 => stream(&frame(1, &vec![b'x'; 70_000])),
        2 => {
            let pings: Vec<u8> = (0..1000).flat_map(|_| frame(9, &[1; 125])).collect();
            stream(&pings)
        }
        3 => stream(&frame(1, &[0xFF, 0xFE, 0x80])),
        // Not masked, with a reserved kind, longer than anything.
        4 => stream(&[0x8B, 0x7F, 0x7F, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF]),
        // Everything from the beginning, and nothing taken of it.
        5 => {
            let socket = follower::open(address, "events,frames,telemetry&after=0")?;
            pause(Duration::from_millis(500));
            drop(socket);
            Ok(())
        }
        // A request that never ends.
        6 => {
            let mut socket = TcpStream::connect(address)?;
            write!(socket, "GET /api/v1/stream HTTP/1.1\r\nHost: {address}\r\n")?;
            for _ in 0..20 {
                write!(socket, "X-More: {}\r\n", "x".repeat(1000))?;
                pause(Duration::from_millis(50));
            }
            Ok(())
        }
        7 => {
            let text = br#"{"type":"subscribe","topics":["frames","events","telemetry","status","commands","runs"]}"#;
            let flood: Vec<u8> = (0..500).flat_map(|_| frame(1, text)).collect();
            stream(&flood)
        }
        8 => {
            let body = "[".repeat(60_000);
            let mut socket = TcpStream::connect(address)?;
            write!(
                socket,
                "POST /api/v1/commands HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {}\r\nIdempotency-Key: x\r\n\
                 Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
                "0".repeat(64),
                body.len()
            )?;
            socket.set_read_timeout(Some(Duration::from_millis(200)))?;
            until_closed(&mut socket)
        }
        _ => {
            for _ in 0..20 {
                drop(TcpStream::connect(address)?);
            }
            Ok(())
        }
    }
}

/// Takes what comes until the server closes, for 3 s at most.
fn until_closed(socket: &mut TcpStream) -> std::io::Result<()> {
    socket.set_read_timeout(Some(Duration::from_secs(3)))?;
    let mut piece = [0; 16 * 1024];
    for _ in 0..200 {
        if socket.read(&mut piece)? == 0 {
            return Ok(());
        }
    }
    Ok(())
}
