meta:
  id: pixelsat
  title: PixelSat I downlink frame
  license: MIT OR Apache-2.0
  ks-version: 0.9
  encoding: ASCII
  endian: be
doc: |
  One downlink frame, from its magic on: 16 + length bytes (short) or 240 (full, zero padded). Find the magic first, and check
  the CRC-32 (ISO-HDLC) yourself: over header and payload in the short form, over all 228 bytes behind it in the full form.
  Units and meanings: docs/icd.md.
seq:
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
    valid:
      max: 224
  - id: payload
    size: length
    type:
      switch-on: packet_type
      cases:
        'packet_type::error': error
        'packet_type::image_info': image_info
        'packet_type::image_chunk': image_chunk
        'packet_type::adcs_info': adcs_info
        'packet_type::schedule_info': schedule_info
        'packet_type::heartbeat': heartbeat
        'packet_type::mode_report': mode_report
        'packet_type::event_report': event_report
  - id: padding
    size-eos: true
    doc: zeros, in a full frame only
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
      - id: chunks
        type: u4
      - id: size_bytes
        type: u4
      - id: width_px
        type: u2
      - id: height_px
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
      - id: event
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
