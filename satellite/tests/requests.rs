//! Every request of the ICD and its answer, and the order in which the satellite checks what it hears.

mod common;

use common::{Ground, Heard, IMAGE_CHUNKS, IMAGE_LEN, SECOND_US, chunk_numbers, config, errors};
use protocol::{
    ChunkRange, ChunkRanges, Downlink, DownlinkSchedule, DownlinkSlot, ErrorCode, ImageInfo, Key, Nonce,
    RequestTag, Resolution, SealedUplink, Telecommand, TorqueProfile, TorqueStep, TwoLines, seal, seal_raw,
};
use satellite::{Camera, Fault, ImageSource, JournalEntry, Refusal, StateChange, TwinConfig};

fn ground() -> Ground {
    Ground::new(config())
}

fn ranges(list: &[(u16, u16)]) -> Telecommand {
    let ranges = list.iter().map(|&(first, count)| ChunkRange { first, count }).collect();
    Telecommand::GetImageRanges(ChunkRanges { ranges })
}

const NO_IMAGE: ImageInfo = ImageInfo { exists: false, chunks: 0, size_bytes: 0, width_px: 0, height_px: 0 };

#[test]
fn ping_is_answered_by_pong_in_a_short_frame_with_its_tag() {
    let mut ground = ground();
    let heard = ground.ask(&Telecommand::Ping);
    assert!(matches!(heard.as_slice(), [Heard { packet: Downlink::Pong, len: 16, .. }]));
    assert_eq!(heard[0].tag, Some(ground.tag));
}

#[test]
fn image_info_tells_what_is_stored() {
    let mut ground = ground();
    let Downlink::ImageInfo(info) = ground.answer(&Telecommand::GetImageInfo) else { panic!() };
    assert!(info.exists && info.is_consistent());
    assert_eq!((info.chunks, info.size_bytes), (IMAGE_CHUNKS, IMAGE_LEN as u32));
    assert_eq!((info.width_px, info.height_px), (408, 304));
}

#[test]
fn image_chunks_come_ascending_and_make_the_image() {
    let mut ground = ground();
    let heard = ground.ask(&Telecommand::GetImageChunk { first: 0, count: 64 });
    assert_eq!(chunk_numbers(&heard), (0..IMAGE_CHUNKS as u16).collect::<Vec<_>>());
    assert!(heard.iter().all(|one| one.len == 240 && one.tag == Some(ground.tag)));
    let mut bytes = Vec::new();
    for one in &heard {
        if let Downlink::ImageChunk(chunk) = one.packet {
            bytes.extend(chunk.data);
        }
    }
    assert_eq!(&bytes[..IMAGE_LEN], ground.twin.image());
    assert!(bytes[IMAGE_LEN..].iter().all(|&byte| byte == 0), "the last chunk is padded with zeros");
}

#[test]
fn chunk_ranges_are_cut_at_the_end_and_summed_without_wrapping() {
    let mut ground = ground();
    let mut numbers = |first, count| chunk_numbers(&ground.ask(&Telecommand::GetImageChunk { first, count }));
    assert_eq!(numbers(2, 2), [2, 3]);
    assert_eq!(numbers(5, u16::MAX), [5, 6]);
    assert_eq!(numbers(6, 1), [6]);
    for (first, count) in [(7, 1), (0, 0), (u16::MAX, u16::MAX)] {
        let answer = ground.answer(&Telecommand::GetImageChunk { first, count });
        assert_eq!(answer, Downlink::Error(ErrorCode::MALFORMED_PACKET));
    }
}

#[test]
fn chunks_without_an_image_are_a_camera_failure() {
    let mut ground = Ground::new(TwinConfig { image: ImageSource::None, ..config() });
    for command in [Telecommand::GetImageChunk { first: 0, count: 1 }, ranges(&[(0, 1)])] {
        assert_eq!(ground.answer(&command), Downlink::Error(ErrorCode::CAMERA_FAILURE));
    }
    assert_eq!(ground.answer(&Telecommand::GetImageInfo), Downlink::ImageInfo(NO_IMAGE));
}

#[test]
fn ranges_come_in_the_listed_order_with_duplicates() {
    let mut ground = ground();
    let heard = ground.ask(&ranges(&[(5, 9), (1, 2), (9, 9), (2, 1)]));
    assert_eq!(chunk_numbers(&heard), [5, 6, 1, 2, 2]);
    assert!(errors(&heard).is_empty(), "one empty range among others is no error");
    for empty in [ranges(&[(7, 1), (0, 0)]), ranges(&[])] {
        assert_eq!(ground.answer(&empty), Downlink::Error(ErrorCode::MALFORMED_PACKET));
    }
    let mut without = Ground::new(TwinConfig { ranges: false, ..config() });
    assert_eq!(without.answer(&ranges(&[(0, 1)])), Downlink::Error(ErrorCode::MALFORMED_PACKET));
}

#[test]
fn a_capture_takes_its_time_and_meanwhile_there_is_no_image() {
    let mut ground = ground();
    let before = ground.twin.image().to_vec();
    let capture =
        Telecommand::CaptureImage { resolution: Resolution::Svga, grey: true, strong_compression: true };
    assert!(ground.ask(&capture).is_empty());
    let capture_tag = ground.tag;
    assert_eq!(ground.answer(&Telecommand::GetImageInfo), Downlink::ImageInfo(NO_IMAGE));
    let chunk = Telecommand::GetImageChunk { first: 0, count: 1 };
    assert_eq!(ground.answer(&chunk), Downlink::Error(ErrorCode::CAMERA_FAILURE));
    let heard = ground.listen(10 * SECOND_US);
    let done = heard.iter().find(|one| one.tag == Some(capture_tag)).unwrap();
    let Downlink::ImageInfo(info) = done.packet else { panic!("{done:?}") };
    assert_eq!((info.exists, info.width_px, info.height_px), (true, 818, 610));
    assert_ne!(ground.twin.image(), before);
    assert_eq!(ground.twin.state().image.unwrap().number, 1);
}

#[test]
fn a_broken_camera_and_a_second_capture_meanwhile_are_camera_failures() {
    let capture =
        Telecommand::CaptureImage { resolution: Resolution::Cif, grey: false, strong_compression: false };
    let mut broken = Ground::new(TwinConfig { camera: Camera::Broken, image: ImageSource::None, ..config() });
    broken.ask(&capture);
    assert_eq!(errors(&broken.listen(9 * SECOND_US)), [ErrorCode::CAMERA_FAILURE]);
    let mut ground = ground();
    ground.ask(&capture);
    assert_eq!(ground.answer(&capture), Downlink::Error(ErrorCode::CAMERA_FAILURE));
}

#[test]
fn a_torque_profile_is_answered_when_it_has_run() {
    let mut ground = ground();
    let step = TorqueStep { torque_n_m: [1e-5, 0.0, 0.0], duration_ms: 15_000 };
    let steps = [step, step].into_iter().collect();
    let start_us = ground.now_us;
    assert!(ground.ask(&Telecommand::ExecuteTorqueProfile(TorqueProfile { steps })).is_empty());
    let (tag, heard) = (ground.tag, ground.listen(40 * SECOND_US));
    let done = heard.iter().find(|one| one.tag == Some(tag)).unwrap();
    assert!(matches!(done.packet, Downlink::AdcsInfo(_)));
    assert!(done.at_us >= start_us + 30 * SECOND_US && done.at_us < start_us + 33 * SECOND_US);
}

#[test]
fn attitude_commands_are_answered_by_adcs_info_in_their_mode() {
    let mut ground = ground();
    let modes = [
        (Telecommand::GetAdcsInfo, 0),
        (Telecommand::SetAdcsAttitude { attitude_mrp: [0.1, 0.0, 0.2] }, 1),
        (Telecommand::SetAdcsTarget { latitude_deg: 48.0, longitude_deg: 11.0 }, 2),
        (Telecommand::SetAdcsOmegaKill, 0),
        (Telecommand::SetAdcsAuto, 2),
    ];
    for (command, mode) in modes {
        let Downlink::AdcsInfo(info) = ground.answer(&command) else { panic!("{command}") };
        assert_eq!(info.mode, mode, "{command}");
    }
}

#[test]
fn the_clock_is_unset_until_it_is_set_and_the_rhythm_stays() {
    let mut ground = ground();
    let first = ground.listen(4 * SECOND_US);
    let Downlink::Heartbeat(beat) = first[0].packet else { panic!() };
    assert_eq!((beat.timestamp_ms, first[0].tag), (0, None));
    let due_us = ground.twin.heartbeat_due_us();
    let answer = ground.answer(&Telecommand::SetTimestamp { utc_ms: 1_900_000_000_000 });
    let Downlink::Heartbeat(beat) = answer else { panic!() };
    assert!((1_900_000_000_000..1_900_000_002_000).contains(&beat.timestamp_ms));
    assert_eq!(ground.twin.heartbeat_due_us(), due_us);
    let next = ground.listen(60 * SECOND_US);
    assert_eq!((next[0].tag, next[0].at_us), (None, due_us));
}

#[test]
fn elements_are_checked_before_they_are_stored() {
    let lines = |second| {
        let first = "1 25544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2927";
        Telecommand::SetTle(TwoLines::new(first, second).unwrap())
    };
    let mut ground = ground();
    let wrong = lines("2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563538");
    assert_eq!(ground.answer(&wrong), Downlink::Error(ErrorCode::MALFORMED_PACKET));
    assert!(!ground.twin.state().elements);
    let right = lines("2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537");
    assert!(matches!(ground.answer(&right), Downlink::Heartbeat(_)));
    assert!(ground.twin.state().elements);
}

#[test]
fn a_forbidden_transmitter_is_silent_also_after_a_reset_until_it_is_allowed() {
    let mut ground = ground();
    assert!(ground.ask(&Telecommand::SetTransmitter { on: false }).is_empty());
    assert!(ground.ask(&Telecommand::Ping).is_empty());
    assert!(ground.ask(&Telecommand::Reset).is_empty());
    assert!(ground.listen(600 * SECOND_US).is_empty());
    assert_eq!(ground.twin.stats().frames, 0);
    let answer = ground.answer(&Telecommand::SetTransmitter { on: true });
    assert!(matches!(answer, Downlink::Heartbeat(_)));
    assert!(!ground.listen(61 * SECOND_US).is_empty());
}

#[test]
fn reset_restarts_uptime_keeps_counter_and_image_and_says_so_after_the_heartbeat() {
    let mut ground = Ground::new(TwinConfig { boot_us: 2 * SECOND_US, ..config() });
    ground.listen(100 * SECOND_US);
    let image = ground.twin.image().to_vec();
    let slot = DownlinkSlot { time_ms: 1, first: 0, count: 1, attitude_mrp: None };
    let schedule = DownlinkSchedule { slots: [slot].into_iter().collect() };
    ground.ask(&Telecommand::SetDownlinkSchedule(schedule));
    let sealed = ground.seal(&Telecommand::Reset);
    ground.hand_over(&sealed);
    let heard = ground.listen(10 * SECOND_US);
    let packets: Vec<Downlink> = heard.iter().map(|one| one.packet).collect();
    let [Downlink::Heartbeat(beat), Downlink::Error(ErrorCode::POST_SYSTEM_RESET)] = packets.as_slice()
    else {
        panic!("{packets:?}")
    };
    assert_eq!(beat.uptime_ms, 5_000);
    assert!(heard.iter().all(|one| one.tag.is_none()));
    assert_eq!((ground.twin.state().boots, ground.twin.image()), (2, image.as_slice()));
    ground.hand_over(&sealed);
    assert!(ground.listen(10 * SECOND_US).is_empty());
    assert_eq!(ground.twin.stats().refused.replayed, 1);
    let Downlink::ScheduleInfo(info) = ground.answer(&schedule_of(&[])) else { panic!() };
    assert_eq!(info.entries, 0);
}

fn schedule_of(slots: &[DownlinkSlot]) -> Telecommand {
    Telecommand::SetDownlinkSchedule(DownlinkSchedule { slots: slots.iter().copied().collect() })
}

#[test]
fn scheduled_chunks_come_at_their_times_without_a_tag() {
    let mut ground = ground();
    const NOON_MS: u64 = 1_900_000_000_000;
    let slot = |after_s: u64, first, attitude_mrp| DownlinkSlot {
        time_ms: NOON_MS + after_s * 1000,
        first,
        count: 2,
        attitude_mrp,
    };
    let slots = [slot(20, 1, Some([0.1, 0.2, 0.3])), slot(30, 100, None), slot(200, 4, None)];
    let Downlink::ScheduleInfo(info) = ground.answer(&schedule_of(&slots)) else { panic!() };
    assert_eq!((info.entries, info.next_ms), (3, NOON_MS + 20_000));
    assert!(chunk_numbers(&ground.listen(300 * SECOND_US)).is_empty(), "without a clock nothing begins");

    ground.ask(&Telecommand::SetTimestamp { utc_ms: NOON_MS });
    let set_us = ground.now_us - SECOND_US;
    let heard = ground.listen(100 * SECOND_US);
    let chunks: Vec<&Heard> =
        heard.iter().filter(|one| matches!(one.packet, Downlink::ImageChunk(_))).collect();
    assert_eq!(chunk_numbers(&heard), [1, 2]);
    assert!(chunks.iter().all(|one| one.tag.is_none()));
    assert!(chunks[0].at_us.abs_diff(set_us + 20 * SECOND_US) < 2 * SECOND_US);
    assert_eq!(errors(&heard), [ErrorCode::SCHEDULED_TRANSMISSION_READ_FAILURE], "beyond the image");
    let Downlink::AdcsInfo(adcs) = ground.answer(&Telecommand::GetAdcsInfo) else { panic!() };
    assert_eq!(adcs.mode, 1, "the slot's attitude was taken");
    let Downlink::ScheduleInfo(info) = ground.answer(&schedule_of(&[])) else { panic!() };
    assert_eq!((info.entries, info.next_ms), (0, 0));
    assert!(chunk_numbers(&ground.listen(300 * SECOND_US)).is_empty(), "the list was cleared");
}

#[test]
fn the_autonomy_extension_is_malformed_here() {
    let mut ground = ground();
    let commands = [
        Telecommand::SetMode { mode: 1, substate: 255 },
        Telecommand::GetModeReport,
        Telecommand::SetParameter { parameter: 1, value: 1.0 },
        Telecommand::GetEvents { first: 0 },
    ];
    for command in commands {
        assert_eq!(ground.answer(&command), Downlink::Error(ErrorCode::MALFORMED_PACKET), "{command}");
    }
}

#[test]
fn what_is_not_authentic_is_never_answered_and_never_remembered() {
    let mut ground = ground();
    ground.listen(4 * SECOND_US);
    let good = ground.seal(&Telecommand::Ping);
    for at in 12..240 {
        let mut bytes = *good.as_bytes();
        bytes[at] ^= 1;
        ground.hand_over(&SealedUplink::from_bytes(bytes).unwrap());
    }
    let other = Key::from_bytes([9; 16]);
    let foreign =
        seal(&other, Nonce::from_bytes([255; 12]), RequestTag::FIRST, &Telecommand::Ping, &[0; 200]);
    ground.hand_over(&foreign);
    assert!(ground.listen(10 * SECOND_US).is_empty());
    assert_eq!(ground.twin.stats().refused.authentication, 229);
    assert_eq!(ground.twin.state().nonces.highest(), None);
    ground.hand_over(&good);
    assert_eq!(ground.listen(SECOND_US).len(), 1, "the forgeries have not used up the nonce");
}

#[test]
fn a_wrong_checksum_is_answered_and_its_counter_is_spent() {
    let mut ground = ground();
    let good = ground.seal(&Telecommand::Reset);
    // the checksum travels in the clear and is not covered by the tag
    let mut bytes = *good.as_bytes();
    bytes[8] ^= 0x80;
    ground.hand_over(&SealedUplink::from_bytes(bytes).unwrap());
    let heard = ground.listen(SECOND_US);
    assert_eq!(errors(&heard), [ErrorCode::CRC_FAILED]);
    assert_eq!(heard[0].tag, Some(ground.tag));
    ground.hand_over(&good);
    assert!(ground.listen(SECOND_US).is_empty());
    assert_eq!((ground.twin.stats().refused.replayed, ground.twin.state().boots), (1, 1));
}

#[test]
fn the_counter_is_checked_before_the_checksum_and_the_checksum_before_the_header() {
    let mut ground = ground();
    ground.ask(&Telecommand::Ping);
    // nonsense in every layer: the first check that fails decides
    let spent = Nonce::new(protocol::Counter(5), [0; 4]);
    ground.hand_over(&seal_raw(&common::key(), spent, 0, &[0xff; 200]));
    assert!(ground.listen(SECOND_US).is_empty());
    assert_eq!(ground.twin.stats().refused.counter, 1);
    let fresh = Nonce::new(protocol::Counter(ground.counter + 1), [0; 4]);
    ground.hand_over(&seal_raw(&common::key(), fresh, 0, &[0xff; 200]));
    assert_eq!(errors(&ground.listen(SECOND_US)), [ErrorCode::CRC_FAILED]);
}

#[test]
fn malformed_requests_are_answered_with_their_tag() {
    let nan = f32::NAN.to_be_bytes();
    let attitude_nan = [nan, nan, nan].concat();
    let mut captures = vec![vec![2, 0], vec![0]];
    captures.push(vec![]);
    let mut cases: Vec<(u8, u16, Vec<u8>)> = vec![
        (0, 1, vec![0]),
        (0, 197, vec![]),
        (0, u16::MAX, vec![]),
        (2, 3, vec![0; 3]),
        (2, 5, vec![0; 5]),
        (4, 1, vec![13]),
        (7, 1, vec![9]),
        (9, 12, attitude_nan),
        (10, 8, [90.5_f32.to_be_bytes(), 0_f32.to_be_bytes()].concat()),
        (12, 7, vec![0; 7]),
        (13, 138, vec![b'x'; 138]),
        (14, 1, vec![49]),
        (15, 1, vec![2]),
        (16, 0, vec![]),
        (0x42, 0, vec![]),
        (0xff, 0, vec![]),
    ];
    cases.extend(captures.into_iter().map(|payload| (6, payload.len() as u16, payload)));
    for (packet_type, length, payload) in cases {
        let mut ground = ground();
        let frame = ground.seal_raw(packet_type, 77, length, &payload);
        ground.hand_over(&frame);
        let heard = ground.listen(SECOND_US);
        assert_eq!(errors(&heard), [ErrorCode::MALFORMED_PACKET], "type {packet_type} length {length}");
        assert_eq!(heard[0].tag, RequestTag::new(77));
        assert_eq!((ground.twin.stats().accepted, ground.twin.stats().refused.malformed), (0, 1));
    }
}

#[test]
fn tag_zero_is_malformed() {
    let mut ground = ground();
    let frame = ground.seal_raw(0, 0, 0, &[]);
    ground.hand_over(&frame);
    assert_eq!(errors(&ground.listen(SECOND_US)), [ErrorCode::MALFORMED_PACKET]);
}

#[test]
fn frames_are_found_in_any_pieces_and_behind_junk() {
    let mut ground = ground();
    let frame = ground.seal(&Telecommand::Ping);
    let mut bytes = b"\xff\x00DESTDESTINY_".to_vec();
    bytes.extend(frame.as_bytes());
    for piece in bytes.chunks(37) {
        ground.twin.receive(0, piece);
    }
    assert_eq!(ground.listen(SECOND_US).len(), 1);
}

#[test]
fn the_counter_is_stored_before_anything_goes_out() {
    let mut ground = ground();
    while ground.twin.next_journal().is_some() {}
    let frame = ground.seal(&Telecommand::Ping);
    ground.hand_over(&frame);
    assert!(ground.twin.poll(SECOND_US).is_none(), "nothing while the journal waits");
    let first = ground.twin.next_journal().unwrap();
    assert!(
        matches!(first, JournalEntry::Stored { change: StateChange::Nonce(nonce), .. } if nonce == frame.nonce())
    );
    assert!(matches!(ground.twin.next_journal(), Some(JournalEntry::Accepted { packet_type: 0, .. })));
    assert!(ground.twin.next_journal().is_none());
    assert!(ground.twin.poll(SECOND_US).is_some());
}

#[test]
fn the_queue_of_answers_is_bounded_and_the_rest_is_refused_as_busy() {
    let mut ground = ground();
    for _ in 0..9 {
        let frame = ground.seal(&Telecommand::Ping);
        ground.hand_over(&frame);
    }
    assert_eq!(ground.ask(&Telecommand::Ping).len(), 4);
    assert_eq!(ground.twin.stats().refused.busy, 6);
    assert!(
        ground
            .journal
            .iter()
            .any(|entry| matches!(entry, JournalEntry::Refused { reason: Refusal::Busy, .. }))
    );
}

#[test]
fn faults_do_what_they_say() {
    let faults = vec![
        (10 * SECOND_US, Fault::SensorNan(true)),
        (70 * SECOND_US, Fault::SensorNan(false)),
        (130 * SECOND_US, Fault::Mute(true)),
        (250 * SECOND_US, Fault::Mute(false)),
        (300 * SECOND_US, Fault::Reset),
    ];
    let mut ground = Ground::new(TwinConfig { faults, ..config() });
    let heard = ground.listen(400 * SECOND_US);
    let beats: Vec<(u64, bool)> = heard
        .iter()
        .filter_map(|one| match one.packet {
            Downlink::Heartbeat(beat) => Some((one.at_us / SECOND_US, beat.omega_rad_s[0].is_nan())),
            _ => None,
        })
        .collect();
    assert_eq!(beats, [(3, false), (63, true), (123, false), (303, false), (363, false)]);
    assert_eq!(errors(&heard), [ErrorCode::IMU_FAILURE, ErrorCode::POST_SYSTEM_RESET]);

    ground.twin.inject(ground.now_us, Fault::DuplicateAnswers(true));
    let twice = ground.ask(&Telecommand::Ping);
    assert_eq!(twice.len(), 2);
    assert_eq!(twice[0].packet, twice[1].packet);
    assert_eq!(twice[0].tag, twice[1].tag);
}

#[test]
fn clock_faults_show_in_the_timestamp() {
    let mut ground = ground();
    let stamp = |ground: &mut Ground| match ground.answer(&Telecommand::SetTransmitter { on: true }) {
        Downlink::Heartbeat(beat) => beat.timestamp_ms,
        other => panic!("{other:?}"),
    };
    ground.ask(&Telecommand::SetTimestamp { utc_ms: 1_900_000_000_000 });
    assert!(stamp(&mut ground) >= 1_900_000_000_000);
    ground.twin.inject(ground.now_us, Fault::ClockStale { behind_ms: 3_600_000 });
    assert!((1_899_996_400_000..1_899_996_500_000).contains(&stamp(&mut ground)));
    ground.twin.inject(ground.now_us, Fault::ClockUnset);
    assert_eq!(stamp(&mut ground), 0);
}
