//! How scalars stand on the wire, and the table from which a packet's struct, codec and fields are made.
//!
//! A packet is written once, as a table in the order of the ICD; offsets follow from the order, the length is asserted
//! at compile time, and the foreign test vectors pin every offset.

use crate::{Field, FieldValue, PayloadError};

/// Reads a payload whose length was checked at the door.
///
/// Reading past the end cannot happen then; should a table ever disagree with its length, zeros come out, and the
/// vectors fail. It never panics.
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    offset: usize,
}

impl<'a> Reader<'a> {
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, offset: 0 }
    }

    pub(crate) const fn at(bytes: &'a [u8], offset: usize) -> Self {
        Self { bytes, offset }
    }

    pub(crate) fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut out = [0; N];
        if let Some(found) = self.bytes.get(self.offset..self.offset + N) {
            out.copy_from_slice(found);
        }
        self.offset += N;
        out
    }

    pub(crate) const fn offset(&self) -> usize {
        self.offset
    }

    pub(crate) fn read<T: Wire>(&mut self) -> Result<T, PayloadError> {
        T::read(self)
    }
}

/// Writes a payload into a caller's buffer that is long enough by construction.
pub(crate) struct Writer<'a> {
    bytes: &'a mut [u8],
    offset: usize,
}

impl<'a> Writer<'a> {
    pub(crate) const fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes, offset: 0 }
    }

    pub(crate) fn put(&mut self, bytes: &[u8]) {
        if let Some(place) = self.bytes.get_mut(self.offset..self.offset + bytes.len()) {
            place.copy_from_slice(bytes);
        }
        self.offset += bytes.len();
    }

    pub(crate) fn write<T: Wire>(&mut self, value: &T) {
        value.write(self);
    }

    pub(crate) const fn offset(&self) -> usize {
        self.offset
    }
}

/// Names what a visitor sees, with the place where the next field stands.
pub(crate) struct Walk<'f> {
    visit: &'f mut dyn FnMut(Field<'_>),
    offset: usize,
    pub(crate) index: Option<u8>,
}

impl<'f> Walk<'f> {
    pub(crate) fn new(visit: &'f mut dyn FnMut(Field<'_>)) -> Self {
        Self { visit, offset: 0, index: None }
    }

    pub(crate) fn field(
        &mut self,
        name: &'static str,
        unit: &'static str,
        value: FieldValue<'_>,
        len: usize,
    ) {
        let (offset, len_u16) = (self.offset as u16, len as u16);
        (self.visit)(Field { name, index: self.index, unit, value, offset, len: len_u16 });
        self.offset += len;
    }

    /// One value under its names: one for a scalar, one per component for a vector.
    pub(crate) fn value<T: Wire>(&mut self, value: &T, names: &[&'static str], unit: &'static str) {
        value.walk(self, names, unit);
    }
}

/// A value with a fixed place on the wire. All numbers are big-endian.
pub(crate) trait Wire: Sized {
    const LEN: usize;
    fn read(reader: &mut Reader<'_>) -> Result<Self, PayloadError>;
    fn write(&self, writer: &mut Writer<'_>);
    fn walk(&self, walk: &mut Walk<'_>, names: &[&'static str], unit: &'static str);
}

macro_rules! number {
    ($($t:ty => $value:expr),*) => {$(
        impl Wire for $t {
            const LEN: usize = size_of::<$t>();
            fn read(reader: &mut Reader<'_>) -> Result<Self, PayloadError> {
                Ok(<$t>::from_be_bytes(reader.take()))
            }
            fn write(&self, writer: &mut Writer<'_>) {
                writer.put(&self.to_be_bytes());
            }
            fn walk(&self, walk: &mut Walk<'_>, names: &[&'static str], unit: &'static str) {
                let value: fn($t) -> FieldValue<'static> = $value;
                walk.field(names.first().copied().unwrap_or(""), unit, value(*self), Self::LEN);
            }
        }
    )*};
}
number!(
    u8 => |v| FieldValue::U(v.into()),
    u16 => |v| FieldValue::U(v.into()),
    u32 => |v| FieldValue::U(v.into()),
    u64 => FieldValue::U,
    f32 => FieldValue::F32
);

impl Wire for bool {
    const LEN: usize = 1;
    fn read(reader: &mut Reader<'_>) -> Result<Self, PayloadError> {
        let offset = reader.offset() as u16;
        match reader.take() {
            [0] => Ok(false),
            [1] => Ok(true),
            [found] => Err(PayloadError::Bool { offset, found }),
        }
    }
    fn write(&self, writer: &mut Writer<'_>) {
        writer.put(&[u8::from(*self)]);
    }
    fn walk(&self, walk: &mut Walk<'_>, names: &[&'static str], unit: &'static str) {
        walk.field(names.first().copied().unwrap_or(""), unit, FieldValue::Bool(*self), 1);
    }
}

impl<const N: usize> Wire for [f32; N] {
    const LEN: usize = 4 * N;
    fn read(reader: &mut Reader<'_>) -> Result<Self, PayloadError> {
        let mut out = [0.0; N];
        for value in &mut out {
            *value = reader.read()?;
        }
        Ok(out)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        self.iter().for_each(|value| writer.write(value));
    }
    fn walk(&self, walk: &mut Walk<'_>, names: &[&'static str], unit: &'static str) {
        for (value, name) in self.iter().zip(names) {
            walk.field(name, unit, FieldValue::F32(*value), 4);
        }
    }
}

/// A packet as a table: `field: type = [names], "unit"`, in wire order; the length is checked at compile time.
macro_rules! packet {
    (
        $(#[$meta:meta])*
        pub struct $name:ident ($len:literal bytes) {
            $( $(#[$field_meta:meta])* $field:ident : $t:ty = [$($label:literal),+], $unit:literal; )*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Debug)]
        pub struct $name {
            $( $(#[$field_meta])* pub $field: $t, )*
        }

        impl $crate::wire::Wire for $name {
            const LEN: usize = 0 $( + <$t as $crate::wire::Wire>::LEN )*;

            fn read(reader: &mut $crate::wire::Reader<'_>) -> Result<Self, $crate::PayloadError> {
                Ok(Self { $( $field: reader.read()?, )* })
            }

            fn write(&self, writer: &mut $crate::wire::Writer<'_>) {
                $( writer.write(&self.$field); )*
            }

            fn walk(&self, walk: &mut $crate::wire::Walk<'_>, _: &[&'static str], _: &'static str) {
                $( walk.value(&self.$field, &[$($label),+], $unit); )*
            }
        }

        const _: () = assert!(<$name as $crate::wire::Wire>::LEN == $len);
    };
}
pub(crate) use packet;
