//! One client of the broker: who it is, what it publishes, what it is answered.

use std::net::SocketAddr;
use std::time::Duration;

use futures_util::{SinkExt as _, StreamExt as _};
use rumqttc::mqttbytes::v4::{
    ConnAck, ConnectReturnCode, LastWill, Packet, PubComp, Publish, SubAck, SubscribeReasonCode, UnsubAck,
};
use rumqttc::mqttbytes::{Protocol, QoS};
use tokio::sync::oneshot;
use tokio_util::sync::CancellationToken;

use super::{HELLO_TIME, Shared};
use crate::clock::{wall_sleep, within};
use crate::ingest::formats::{RECEPTION_MAX, Topic};
use crate::ways::boards::Told;
use crate::ways::intake::Came as Taken;
use crate::ways::mqtt::wire::{CONNECT, Came, Stream, Wire, wire};
use crate::ways::mqtt::words::Words;

/// What an answer may take to be written.
const WRITE_TIME: Duration = Duration::from_secs(10);
/// How long a client may be silent that named no keep-alive.
const SILENCE: Duration = Duration::from_secs(300);
/// A wrong password is answered after so long: nobody tries many.
const WRONG_LOGIN: Duration = Duration::from_secs(2);
/// Characters of a client id.
const ID_MAX: usize = 64;

/// A client that was let in.
pub(super) struct Session {
    wire: Wire,
    client_id: String,
    /// Under whose topics it may publish; `None`: anybody's.
    user: Option<String>,
    will: Option<LastWill>,
    silence: Duration,
    /// What it is to be told when the archive has its messages.
    words: Words,
    /// What came at QoS 2 and is not released yet.
    unreleased: Vec<u16>,
}

/// What became of a message.
enum Published {
    /// It is dealt with.
    Done,
    /// The board says hello, under this topic.
    Welcome(Topic),
    /// A word comes when the archive has it.
    Waits(oneshot::Receiver<()>),
}

/// How a session ends.
enum End {
    /// It took its leave, or another came with its name.
    Quiet,
    /// It was lost: its last will is done.
    Lost,
}

/// Waits for CONNECT and answers it. `None`: it is not let in.
pub(super) async fn begin(shared: &Shared, stream: Box<dyn Stream>, peer: SocketAddr) -> Option<Session> {
    let mut wire = wire(stream, RECEPTION_MAX, CONNECT);
    let connect = match within(HELLO_TIME, wire.next()).await {
        Some(Some(Ok(Came::Packet(Packet::Connect(connect))))) => connect,
        _ => {
            shared.way.count("no-hello");
            return None;
        }
    };
    let refuse = |code| ConnAck { session_present: false, code };
    if connect.protocol != Protocol::V4 {
        let _ =
            within(WRITE_TIME, wire.send(Packet::ConnAck(refuse(ConnectReturnCode::RefusedProtocolVersion))))
                .await;
        return None;
    }
    let login = connect.login.as_ref().map(|login| (login.username.as_str(), login.password.as_str()));
    let Some(user) = shared.admits(login) else {
        shared.way.count("wrong-logins");
        tracing::warn!(ear = %shared.way.name, %peer, "ear {}: a client at {peer} gave no name and password that are good here", shared.way.name);
        wall_sleep(WRONG_LOGIN).await;
        let _ =
            within(WRITE_TIME, wire.send(Packet::ConnAck(refuse(ConnectReturnCode::BadUserNamePassword))))
                .await;
        return None;
    };
    let client_id = match connect.client_id.as_str() {
        "" if connect.clean_session => format!("unnamed {peer}"),
        id if !id.is_empty() && id.chars().count() <= ID_MAX && !id.contains(char::is_control) => {
            // Two users with one id do not push each other off.
            format!("{}/{id}", user.as_deref().unwrap_or_default())
        }
        _ => {
            let _ =
                within(WRITE_TIME, wire.send(Packet::ConnAck(refuse(ConnectReturnCode::BadClientId)))).await;
            return None;
        }
    };
    let welcome = ConnAck { session_present: false, code: ConnectReturnCode::Success };
    within(WRITE_TIME, wire.send(Packet::ConnAck(welcome))).await?.ok()?;
    shared.way.count("connections");
    let silence = match connect.keep_alive {
        0 => SILENCE,
        seconds => Duration::from_millis(u64::from(seconds) * 1_500),
    };
    Some(Session {
        wire,
        client_id,
        user,
        will: connect.last_will,
        silence,
        words: Words::default(),
        unreleased: Vec::new(),
    })
}

impl Session {
    /// Until it goes.
    pub(super) async fn run(mut self, shared: &Shared) {
        let gone = CancellationToken::new();
        let number = shared.enter(&self.client_id, &gone);
        let end = tokio::select! {
            () = gone.cancelled() => End::Quiet,
            end = self.talk(shared) => end,
        };
        shared.leave(&self.client_id, number);
        if let (End::Lost, Some(will)) = (end, self.will.take()) {
            self.publish(shared, &will.topic, &will.message, false).await;
        }
    }

    async fn talk(&mut self, shared: &Shared) -> End {
        loop {
            let came = tokio::select! {
                word = self.words.next(), if self.words.is_any() => {
                    let Some(Ok(word)) = word else { return End::Lost };
                    if self.answer(word).await.is_err() {
                        return End::Lost;
                    }
                    continue;
                }
                came = within(self.silence, self.wire.next()), if self.words.has_room() => came,
            };
            let came = match came {
                Some(Some(Ok(came))) => came,
                Some(Some(Err(error))) => {
                    shared.way.count("malformed-packets");
                    tracing::debug!(client = %self.client_id, %error, "a client of the broker: {error}");
                    return End::Lost;
                }
                Some(None) | None => return End::Lost,
            };
            let answer = match came {
                Came::TooLong { is_reception } => {
                    if is_reception {
                        shared.intake.too_long();
                    } else {
                        shared.way.count("too-long");
                    }
                    None
                }
                Came::Packet(Packet::Publish(publish)) => match self.published(shared, publish).await {
                    Ok(()) => None,
                    Err(()) => return End::Lost,
                },
                Came::Packet(Packet::PubRel(release)) => {
                    self.unreleased.retain(|id| *id != release.pkid);
                    Some(Packet::PubComp(PubComp::new(release.pkid)))
                }
                Came::Packet(Packet::Subscribe(subscribe)) => {
                    let codes =
                        subscribe.filters.iter().map(|filter| self.subscribes(&filter.path)).collect();
                    Some(Packet::SubAck(SubAck::new(subscribe.pkid, codes)))
                }
                Came::Packet(Packet::Unsubscribe(unsubscribe)) => {
                    Some(Packet::UnsubAck(UnsubAck::new(unsubscribe.pkid)))
                }
                Came::Packet(Packet::PingReq) => Some(Packet::PingResp),
                Came::Packet(Packet::Disconnect) => return End::Quiet,
                // A second CONNECT, or what only brokers say.
                Came::Packet(_) => return End::Lost,
            };
            if let Some(answer) = answer
                && self.answer(answer).await.is_err()
            {
                return End::Lost;
            }
        }
    }

    async fn answer(&mut self, packet: Packet) -> Result<(), ()> {
        match within(WRITE_TIME, self.wire.send(packet)).await {
            Some(Ok(())) => Ok(()),
            _ => Err(()),
        }
    }

    /// A board hears its own commands and those to all. There are none but `begine`, and no way for others to make one.
    fn subscribes(&self, filter: &str) -> SubscribeReasonCode {
        let own = match &self.user {
            Some(user) => filter.starts_with(&format!("tinygs/{user}/")),
            None => filter.starts_with("tinygs/"),
        };
        if own || filter.starts_with("tinygs/global/") {
            SubscribeReasonCode::Success(QoS::AtMostOnce)
        } else {
            SubscribeReasonCode::Failure
        }
    }

    async fn published(&mut self, shared: &Shared, publish: Publish) -> Result<(), ()> {
        let again = publish.qos == QoS::ExactlyOnce && self.unreleased.contains(&publish.pkid);
        let mut stored = None;
        if !again {
            let wants_word = Words::wants(publish.qos);
            match self.publish(shared, &publish.topic, &publish.payload, wants_word).await {
                Published::Welcome(topic) => self.tune(shared, &topic).await?,
                Published::Waits(word) => stored = Some(word),
                Published::Done => {}
            }
        }
        if publish.qos == QoS::ExactlyOnce && !again {
            self.unreleased.push(publish.pkid);
            if self.unreleased.len() > 32 {
                return Err(());
            }
        }
        self.words.owe(publish.qos, publish.pkid, stored);
        Ok(())
    }

    /// Takes a message of the board in.
    async fn publish(&self, shared: &Shared, topic: &str, payload: &[u8], wants_word: bool) -> Published {
        let parsed = Topic::parse(topic);
        let Some(parsed) = parsed.filter(|topic| self.user.as_ref().is_none_or(|user| *user == topic.user))
        else {
            // A command, somebody else's name, anything: it ends here.
            shared.way.count("messages");
            shared.way.count("other-topics");
            return Published::Done;
        };
        shared.way.count("messages");
        shared.way.works();
        match shared.intake.of_board(parsed.clone(), payload, wants_word).await {
            Taken::Done(Told::Welcome) => Published::Welcome(parsed),
            Taken::Done(_) => Published::Done,
            Taken::Waits(word) => Published::Waits(word),
        }
    }

    /// Tells the board that said hello what to listen to, where the configuration says it.
    async fn tune(&mut self, shared: &Shared, board: &Topic) -> Result<(), ()> {
        let Some(modem) = &shared.modem else { return Ok(()) };
        let topic = format!("tinygs/{}/{}/cmnd/begine", board.user, board.station);
        self.answer(Packet::Publish(Publish::new(topic, QoS::AtMostOnce, modem.clone()))).await
    }
}
