meta:
  id: pixelsat
  title: PixelSat I downlink frame
  license: MIT OR Apache-2.0
  ks-version: 0.9
  encoding: ASCII
  endian: be
doc: |
  One packet as a LoRa receiver hands it over: 0 to 3 bytes of a radio module's header, then one downlink frame, 16 + length
  bytes (short form) or 240 (full form, zero padded), then whatever else was received. A packet without the magic PIXELSAT at
  byte 0, 1, 2 or 3 is not ours and fails at once. Everything else passes: a payload whose type or length is not known, and one
  that was cut, is left as raw bytes.

  Kaitai Struct computes no checksum. A frame is intact if crc32 equals the CRC-32 (ISO-HDLC, as in zlib and Ethernet) of
  checked_short or of checked_full; believe no value of any other.

  Units are at the end of the names. Meanings: docs/icd.md. Known answers: frames.json beside this file.
doc-ref: docs/icd.md
seq:
  - id: module_header
    size: lead
    doc: what a radio module put before the frame; usually nothing
  - id: magic
    contents: PIXELSAT
  - id: crc32
    type: u4
  - id: packet_type
    type: u1
    enum: packet_type
  - id: tag
    type: u1
    doc: number of the request this answers, 0 = nobody asked
  - id: length
    type: u2
    doc: of the payload, 0..=224
  - id: payload
    size: payload_size
    type:
      switch-on: layout
      cases:
        1: error
        2: image_info
        3: image_chunk
        4: adcs_info
        5: schedule_info
        6: heartbeat
        0x40: mode_report
        0x41: event_report
    doc: raw bytes when layout is 255
  - id: rest
    size-eos: true
    doc: zeros in a full frame; else bytes that do not belong to the frame
instances:
  magic_at_0:
    pos: 0
    size: 8
  magic_at_1:
    pos: 1
    size: 8
  magic_at_2:
    pos: 2
    size: 8
  magic_at_3:
    pos: 3
    size: 8
  lead:
    doc: bytes before the magic
    value: >-
      _io.size < 9 or magic_at_0 == [0x50, 0x49, 0x58, 0x45, 0x4c, 0x53, 0x41, 0x54] ? 0 :
      magic_at_1 == [0x50, 0x49, 0x58, 0x45, 0x4c, 0x53, 0x41, 0x54] ? 1 :
      _io.size >= 10 and magic_at_2 == [0x50, 0x49, 0x58, 0x45, 0x4c, 0x53, 0x41, 0x54] ? 2 :
      _io.size >= 11 and magic_at_3 == [0x50, 0x49, 0x58, 0x45, 0x4c, 0x53, 0x41, 0x54] ? 3 : 0
  available:
    value: _io.size - lead - 16
    doc: bytes behind the frame's header
  payload_size:
    value: 'length < available ? length : available'
  first_byte:
    pos: lead + 16
    type: u1
    if: available >= 1
    doc: of the payload
  heartbeat_cam_byte:
    pos: lead + 132
    type: u1
    if: available >= 117
  layout:
    doc: number of the payload's type if its length, its flags and its count are what the type wants, else 255
    value: >-
      length > available ? 255 :
      packet_type == packet_type::error and length == 1 ? 1 :
      packet_type == packet_type::image_info and length == 13 and first_byte <= 1 ? 2 :
      packet_type == packet_type::image_chunk and length == 224 ? 3 :
      packet_type == packet_type::adcs_info and length == 141 ? 4 :
      packet_type == packet_type::schedule_info and length == 9 ? 5 :
      packet_type == packet_type::heartbeat and length == 117 and heartbeat_cam_byte <= 1 ? 6 :
      packet_type == packet_type::mode_report and length == 25 ? 0x40 :
      packet_type == packet_type::event_report and length >= 1 and length == 1 + 17 * first_byte ? 0x41 : 255
  checked_short:
    pos: lead + 12
    size: 4 + length
    if: length <= available
    doc: what crc32 covers in a short frame
  checked_full:
    pos: lead + 12
    size: 228
    if: available >= 224
    doc: what crc32 covers in a full frame
  tinygs_satellite:
    value: '"PixelSat-I"'
types:
  vector:
    seq:
      - id: x
        type: f4
      - id: y
        type: f4
      - id: z
        type: f4
  sun_sensors:
    seq:
      - id: plus_x
        type: f4
      - id: minus_x
        type: f4
      - id: plus_y
        type: f4
      - id: minus_y
        type: f4
      - id: plus_z
        type: f4
      - id: minus_z
        type: f4
  error:
    seq:
      - id: code
        type: u1
        enum: error_code
  image_info:
    seq:
      - id: exists
        type: u1
        doc: if 0, all else is 0
      - id: chunks
        type: u4
      - id: image_size_bytes
        type: u4
      - id: res_x_px
        type: u2
      - id: res_y_px
        type: u2
  image_chunk:
    seq:
      - id: index
        type: u2
      - id: data
        size: 222
        doc: the file from byte 222 * index on; zeros behind its end
  adcs_info:
    seq:
      - id: uptime_ms
        type: u4
      - id: mode
        type: u1
        enum: adcs_mode
      - id: estimator_status
        type: u2
      - id: controller_status
        type: u2
      - id: gyro_rad_s
        type: vector
      - id: mag_t
        type: vector
      - id: accel_m_s2
        type: vector
      - id: css
        type: sun_sensors
      - id: attitude_mrp
        type: vector
      - id: angular_velocity_rad_s
        type: vector
      - id: gyro_bias_rad_s
        type: vector
      - id: target_attitude_mrp
        type: vector
      - id: attitude_error_mrp
        type: vector
      - id: commanded_torque_n_m
        type: vector
  schedule_info:
    seq:
      - id: entries
        type: u1
      - id: next_ms
        type: u8
        doc: since 1970 UTC, 0 if there is none
  heartbeat:
    seq:
      - id: r_teme_km
        type: vector
      - id: v_teme_km_s
        type: vector
      - id: mag_t
        type: vector
      - id: omega_rad_s
        type: vector
      - id: accel_m_s2
        type: vector
      - id: css
        type: sun_sensors
      - id: att_mrp
        type: vector
      - id: rad
        type: f4
      - id: temp_c
        type: f4
      - id: uptime_ms
        type: u4
      - id: timestamp_ms
        type: u8
        doc: since 1970 UTC, 0 if the satellite has no clock
      - id: cam
        type: u1
    instances:
      tinygs_temp:
        value: temp_c
        doc: °C, under the name that the dashboards of TinyGS know
  mode_report:
    seq:
      - id: model
        type: u1
        enum: model
      - id: mode
        type: u1
      - id: substate
        type: u1
        doc: 255 = none
      - id: triggers
        type: u4
      - id: in_mode_s
        type: u4
      - id: no_comm_s
        type: u4
      - id: boots
        type: u4
      - id: schedule_left
        type: u2
      - id: battery_v
        type: f4
  event_report:
    seq:
      - id: count
        type: u1
      - id: events
        type: event
        repeat: expr
        repeat-expr: count
  event:
    seq:
      - id: sequence
        type: u4
      - id: time_ms
        type: u8
      - id: code
        type: u1
      - id: argument
        type: u4
enums:
  packet_type:
    0: pong
    1: error
    2: image_info
    3: image_chunk
    4: adcs_info
    5: schedule_info
    6: heartbeat
    0x40: mode_report
    0x41: event_report
  adcs_mode:
    0: velocity_kill
    1: attitude_target
    2: tracking_target
  model:
    0: unused
    1: chess
    2: hermes
  error_code:
    1: malformed_packet
    2: crc_failed
    3: scheduled_transmission_read_failure
    4: transceiver_timeout
    16: imu_failure
    17: imu_nonfatal_failure
    18: sun_sensor_failure
    19: magnetometer_noisy
    20: magnetometer_pwm_failure
    21: igrf_read_failure
    22: acs_pid_failure
    23: angular_velocity_abnormally_high
    32: post_system_reset
    33: rtc_failure
    34: camera_failure
    35: no_tle_stored
    36: low_battery
