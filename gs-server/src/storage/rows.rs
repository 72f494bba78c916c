//! The rows as they stand in the tables: numbers, text and bytes, for whoever reads the station's memory.
//!
//! Times are microseconds since 1970 UTC. Satellite, station and link are the names of the configuration, keys are
//! their ids as 8 hex digits.

use super::row::row;

row! {
    /// What the folder is; one row.
    MetaRow in "meta" {
        /// Always 1.
        id: i64,
        /// Whose memory it is: the name under which it was last opened.
        station: String,
        /// Made by a simulation.
        simulated: bool,
        /// When the database was made, by the machine's clock.
        created_at_us: i64,
        /// CRC-32 of the schema's text.
        schema_crc: i64,
    }
}

row! {
    /// A raw frame.
    FrameRow in "frames" {
        /// Id, rising in the order of arrival.
        id: i64,
        /// Heard from.
        satellite: String,
        /// First heard by.
        station: String,
        /// First heard over.
        link: String,
        /// The whole frame, 16 to 240 bytes.
        bytes: Vec<u8>,
        /// `full` or `short`.
        form: String,
        /// Packet type byte; `None` when the header makes no sense.
        packet_type: Option<i64>,
        /// Request tag; `None` for 0 and without a header.
        tag: Option<i64>,
        /// It lay inside another valid frame.
        nested: bool,
        /// When its last byte was received.
        heard_at_us: i64,
    }
}

row! {
    /// One station heard one frame.
    ReceptionRow in "receptions" {
        /// What was heard.
        frame: i64,
        /// From whom.
        satellite: String,
        /// By whom.
        station: String,
        /// Over what.
        link: String,
        /// `radio` or `file`.
        source: String,
        /// When its last byte was received.
        received_at_us: i64,
        /// Received power in dBm, when known.
        rssi_dbm: Option<i64>,
    }
}

row! {
    /// A kind of value that a satellite sends.
    ParameterRow in "parameters" {
        /// Its number in this database.
        id: i64,
        /// Whose value.
        satellite: String,
        /// `packet.field`, e.g. `heartbeat.temp`.
        name: String,
        /// The unit, empty when it has none or nobody knows.
        unit: String,
    }
}

row! {
    /// From whom, by whom and over what values came.
    RouteRow in "routes" {
        /// Its number in this database.
        id: i64,
        /// From whom.
        satellite: String,
        /// By whom.
        station: String,
        /// Over what.
        link: String,
    }
}

row! {
    /// One value.
    TelemetryRow in "telemetry" {
        /// Which parameter, by its number in this database.
        parameter: i64,
        /// When it was heard.
        at_us: i64,
        /// The frame it stands in.
        frame: i64,
        /// From whom, by whom and over what that frame was first heard, by its number in this database.
        route: i64,
        /// The value; `None` is invalid (NaN or infinite in the frame).
        value: Option<f64>,
        /// The rules by which it was derived.
        decoder_version: i64,
    }
}

row! {
    /// A telecommand as it was accepted.
    CommandRow in "commands" {
        /// Id, rising.
        id: i64,
        /// To whom.
        satellite: String,
        /// From where.
        station: String,
        /// Over what.
        link: String,
        /// The id of the key that seals it.
        key: String,
        /// Who wants it.
        principal: String,
        /// The standing order that made it, when the machine did.
        download: Option<i64>,
        /// Packet type byte.
        packet_type: i64,
        /// Payload as it goes into the frame.
        payload: Vec<u8>,
        /// The telecommand's name, e.g. `GetImageInfo`.
        name: String,
        /// Higher goes first.
        priority: i64,
        /// `heard` or `blind`.
        gate: String,
        /// How often it may be radiated.
        attempts_allowed: i64,
        /// When it was accepted.
        created_at_us: i64,
        /// After this it is not radiated any more.
        expires_at_us: Option<i64>,
    }
}

row! {
    /// A step in the life of a telecommand.
    StageRow in "command_stages" {
        /// Which command.
        command: i64,
        /// To whom.
        satellite: String,
        /// From where.
        station: String,
        /// Over what.
        link: String,
        /// The id of the key that seals it.
        key: String,
        /// Attempt number, from 1; 0 before the first.
        attempt: i64,
        /// The word of [`mission::Stage`].
        stage: String,
        /// When.
        at_us: i64,
        /// Who caused it.
        who: String,
        /// Why, as a sentence.
        why: String,
        /// The frame that proves it.
        frame: Option<i64>,
    }
}

row! {
    /// A sealed uplink frame: its counter and nonce are spent.
    SealedRow in "sealed_frames" {
        /// The id of the key.
        key: String,
        /// Its counter.
        counter: i64,
        /// Its nonce, 12 bytes.
        nonce: Vec<u8>,
        /// What it carries.
        command: i64,
        /// Which attempt of that.
        attempt: i64,
        /// The request tag inside.
        tag: i64,
        /// To whom.
        satellite: String,
        /// From where.
        station: String,
        /// Over what.
        link: String,
        /// The 240 bytes.
        bytes: Vec<u8>,
        /// When it was sealed.
        sealed_at_us: i64,
    }
}

row! {
    /// Counters at or below this are gone.
    CounterFloorRow in "counter_floors" {
        /// Where it was confirmed.
        station: String,
        /// The id of the key.
        key: String,
        /// The highest counter that counts as used.
        counter: i64,
        /// When.
        at_us: i64,
        /// Who confirmed it.
        who: String,
    }
}

row! {
    /// An image that the satellite declared.
    ImageRow in "images" {
        /// Id, rising.
        id: i64,
        /// Whose image.
        satellite: String,
        /// Declared to.
        station: String,
        /// Declared over.
        link: String,
        /// The frame that declared it.
        declared_by: i64,
        /// When.
        declared_at_us: i64,
        /// Bytes of the file.
        size_bytes: i64,
        /// Number of chunks.
        chunks: i64,
        /// Width in pixels.
        width_px: i64,
        /// Height in pixels.
        height_px: i64,
        /// Chunks held.
        held: i64,
        /// Chunks of which there are versions that differ.
        conflicts: i64,
        /// When the last chunk arrived.
        completed_at_us: Option<i64>,
        /// SHA-256 of the whole file, once complete.
        sha256: Option<Vec<u8>>,
    }
}

row! {
    /// A chunk of an image, or another version of one.
    ChunkRow in "chunks" {
        /// Of which image.
        image: i64,
        /// Which chunk, from 0.
        chunk_index: i64,
        /// The frame that brought it.
        frame: i64,
        /// From whom.
        satellite: String,
        /// Heard by.
        station: String,
        /// Heard over.
        link: String,
        /// When.
        at_us: i64,
        /// Its bytes differ from those held: used for nothing.
        conflict: bool,
        /// The 222 bytes, padding included.
        data: Vec<u8>,
    }
}

row! {
    /// A standing order to bring an image home.
    DownloadRow in "downloads" {
        /// Id, rising.
        id: i64,
        /// From whom.
        satellite: String,
        /// By which station.
        station: String,
        /// Over what.
        link: String,
        /// The image, once it is known.
        image: Option<i64>,
        /// Who wants it.
        principal: String,
        /// `active`, `complete`, `cancelled` or `failed`.
        state: String,
        /// When it was ordered.
        created_at_us: i64,
        /// Requests for chunks radiated so far.
        requests: i64,
        /// Chunks asked for in all requests together.
        chunks_requested: i64,
        /// Chunks asked for although held.
        chunks_bridged: i64,
    }
}

row! {
    /// The state of a limit.
    LimitRow in "limits" {
        /// Whose value.
        satellite: String,
        /// Which value.
        parameter: String,
        /// Where it was judged.
        station: String,
        /// The word of [`mission::Level`].
        level: String,
        /// Since when.
        since_us: i64,
        /// The value that decided it; `None` when invalid.
        value: Option<f64>,
    }
}

row! {
    /// A set of mean elements.
    ElementsRow in "elements" {
        /// Id, rising in the order in which they were added.
        id: i64,
        /// Whose.
        satellite: String,
        /// The station that keeps them.
        station: String,
        /// NORAD_CAT_ID, when their message told it.
        norad_cat_id: Option<i64>,
        /// OBJECT_NAME, when their message told it.
        object_name: Option<String>,
        /// Their epoch.
        epoch_us: i64,
        /// Where they came from.
        source: String,
        /// When they were added.
        added_at_us: i64,
        /// Who added them.
        who: String,
        /// The whole set as one OMM in JSON.
        omm: String,
    }
}

row! {
    /// A pass over the station, as the elements told it when it was near.
    PassRow in "passes" {
        /// Id, rising.
        id: i64,
        /// Who passes.
        satellite: String,
        /// Over which station.
        station: String,
        /// Acquisition of signal.
        aos_at_us: i64,
        /// Greatest elevation.
        tca_at_us: i64,
        /// Loss of signal; `None` for an object that does not set.
        los_at_us: Option<i64>,
        /// Elevation at TCA, degrees.
        max_elevation_deg: f64,
        /// When it ended; `None` while it lasts.
        ended_at_us: Option<i64>,
    }
}

row! {
    /// A plan that was handed over.
    PlanRow in "plans" {
        /// Id, rising.
        id: i64,
        /// Its name.
        name: String,
        /// Whom it commands.
        satellite: String,
        /// The station that runs it.
        station: String,
        /// The plan as JSON, in the words of the API.
        plan: String,
        /// When it was handed over.
        added_at_us: i64,
        /// By whom.
        who: String,
        /// It may run.
        armed: bool,
        /// Passes that an operator chose, as a JSON array.
        picks: String,
        /// When it was withdrawn; `None` while it is in use.
        withdrawn_at_us: Option<i64>,
    }
}

row! {
    /// A plan in one pass.
    RunRow in "plan_runs" {
        /// Id, rising.
        id: i64,
        /// Which plan.
        plan: i64,
        /// Whom it commands.
        satellite: String,
        /// From which station.
        station: String,
        /// Over which link.
        link: Option<String>,
        /// The pass, once it began.
        pass: Option<i64>,
        /// Begin of the contact.
        aos_at_us: i64,
        /// Its end.
        los_at_us: i64,
        /// How it stands.
        state: String,
        /// Why, where there is a why.
        why: Option<String>,
        /// How far it has come, as JSON.
        progress: String,
        /// How it ended.
        outcome: Option<String>,
        /// When it was last changed.
        at_us: i64,
    }
}

row! {
    /// What a command waits for besides contact.
    ConditionRow in "command_conditions" {
        /// Which command.
        command: i64,
        /// The condition as JSON, in the words of the API.
        condition: String,
    }
}

row! {
    /// Elements that a pass used.
    PassElementsRow in "pass_elements" {
        /// Which pass.
        pass: i64,
        /// Which elements.
        elements: i64,
        /// Since when.
        from_us: i64,
    }
}

row! {
    /// An event in the one durable sequence.
    EventRow in "events" {
        /// Its place.
        seq: i64,
        /// When it happened.
        at_us: i64,
        /// The word of [`mission::record::EventKind`].
        kind: String,
        /// The word of [`mission::Level`].
        level: String,
        /// Satellite, when it concerns one.
        satellite: Option<String>,
        /// Station.
        station: String,
        /// Link, when it concerns one.
        link: Option<String>,
        /// The id of a key, when it concerns one.
        key: Option<String>,
        /// A frame.
        frame: Option<i64>,
        /// A command.
        command: Option<i64>,
        /// An image.
        image: Option<i64>,
        /// A download.
        download: Option<i64>,
        /// One sentence that stands alone.
        message: String,
    }
}

row! {
    /// Who did what.
    AuditRow in "audit" {
        /// Its place.
        id: i64,
        /// Where.
        station: String,
        /// When.
        at_us: i64,
        /// Who.
        who: String,
        /// A verb, e.g. `command.create`.
        action: String,
        /// What it was about, without secrets.
        detail: String,
    }
}

row! {
    /// What ties a row of the audit to the one before it.
    AuditLinkRow in "audit_links" {
        /// The row.
        audit: i64,
        /// SHA-256 over the hash of the row before and this row.
        hash: Vec<u8>,
    }
}

row! {
    /// An accepted intent.
    IntentRow in "intents" {
        /// Who.
        principal: String,
        /// Under which key.
        idempotency_key: String,
        /// Where it was accepted.
        station: String,
        /// SHA-256 of the request.
        digest: Vec<u8>,
        /// Which kind of [`mission::Accepted`].
        accepted: String,
        /// The id it points at.
        subject: Option<i64>,
        /// When.
        at_us: i64,
    }
}
