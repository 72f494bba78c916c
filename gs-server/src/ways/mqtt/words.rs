//! Words that are owed to whoever published: each is said when the archive has the message, in the order in which they came.

use std::future::Future;
use std::pin::Pin;

use futures_util::StreamExt as _;
use futures_util::stream::FuturesOrdered;
use rumqttc::mqttbytes::QoS;
use rumqttc::mqttbytes::v4::{Packet, PubAck, PubRec};
use tokio::sync::oneshot;

/// Messages of one connection that wait for their word; nothing more is read of it then.
const MOST: usize = 256;

type Word = Pin<Box<dyn Future<Output = Result<Packet, Never>> + Send + Sync>>;

/// The archive will never have it: no word may be said, and the sender must send it again.
#[derive(Debug)]
pub(in crate::ways) struct Never;

/// What is owed on one connection.
#[derive(Default)]
pub(in crate::ways) struct Words(FuturesOrdered<Word>);

impl Words {
    /// Whether the sender of such a message waits for a word.
    pub(in crate::ways) fn wants(qos: QoS) -> bool {
        qos != QoS::AtMostOnce
    }

    /// Owes the word for a message: at once, or when the archive has it.
    pub(in crate::ways) fn owe(&mut self, qos: QoS, pkid: u16, stored: Option<oneshot::Receiver<()>>) {
        let word = match qos {
            QoS::AtMostOnce => return,
            QoS::AtLeastOnce => Packet::PubAck(PubAck::new(pkid)),
            QoS::ExactlyOnce => Packet::PubRec(PubRec::new(pkid)),
        };
        self.0.push_back(Box::pin(async move {
            if let Some(stored) = stored {
                stored.await.map_err(|_| Never)?;
            }
            Ok(word)
        }));
    }

    /// Something is owed.
    pub(in crate::ways) fn is_any(&self) -> bool {
        !self.0.is_empty()
    }

    /// More may be owed.
    pub(in crate::ways) fn has_room(&self) -> bool {
        self.0.len() < MOST
    }

    /// The next word, once it may be said; `None` when nothing is owed. Nothing is lost when it is not waited for to the end.
    pub(in crate::ways) async fn next(&mut self) -> Option<Result<Packet, Never>> {
        self.0.next().await
    }
}
