//! Every scalar of a packet by name, unit and place: one walk drives JSON, telemetry points, plots and inspectors.

/// One scalar (or one run of raw bytes) of a packet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Field<'a> {
    /// Stable name, `r_teme.x`, `uptime`, `css.plus_x`; fields of list entries repeat, see `index`.
    pub name: &'static str,
    /// Entry this field belongs to, from 0, when it stands in a list.
    pub index: Option<u8>,
    /// Unit: `km`, `rad/s`, `ms`; empty when there is none or nobody knows it.
    pub unit: &'static str,
    /// The value as received. Floats may be NaN or infinite.
    pub value: FieldValue<'a>,
    /// Offset in the payload, in bytes.
    pub offset: u16,
    /// Length on the wire, in bytes.
    pub len: u16,
}

/// Value of a [`Field`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum FieldValue<'a> {
    /// IEEE 754 binary32; NaN and infinities are legal downlink.
    F32(f32),
    /// Any unsigned number.
    U(u64),
    /// 0 or 1 on the wire.
    Bool(bool),
    /// Opaque bytes: image data, text.
    Bytes(&'a [u8]),
}
