//! The downlink as XTCE 1.2: one container per packet, one parameter per field.
//!
//! Parameters are named `packet_field_unit`, since XTCE allows no dots in names; the name that the archive uses stands
//! beside it as an alias.

use std::{collections::BTreeMap, fmt::Write as _};

use protocol::{
    AdcsInfo, DOWN_PAYLOAD_MAX, Downlink, ErrorCode, EventReport, FieldValue, SHORT_OVERHEAD, down_type,
};

use crate::names;

const NAMESPACE: &str = "http://www.omg.org/spec/XTCE/20180204";

/// Everything that stands in the file, in its order.
#[derive(Default)]
struct Document {
    types: BTreeMap<String, String>,
    parameters: String,
    containers: String,
}

/// One field of a packet.
struct Parameter {
    name: String,
    alias: Option<String>,
    type_name: String,
}

impl Document {
    fn parameter(&mut self, parameter: &Parameter) {
        let Parameter { name, alias, type_name } = parameter;
        let out = &mut self.parameters;
        match alias {
            Some(alias) => writeln!(
                out,
                "      <Parameter parameterTypeRef=\"{type_name}\" name=\"{name}\">\n        <AliasSet><Alias \
                 nameSpace=\"PixelSat Ground\" alias=\"{alias}\"/></AliasSet>\n      </Parameter>"
            ),
            None => writeln!(out, "      <Parameter parameterTypeRef=\"{type_name}\" name=\"{name}\"/>"),
        }
        .unwrap();
    }

    /// A container with these parameters behind those of `base`, where each of the comparisons holds.
    fn container(
        &mut self,
        name: &str,
        base: &str,
        wanted: &[(&str, &str, usize)],
        parameters: &[Parameter],
    ) {
        parameters.iter().for_each(|parameter| self.parameter(parameter));
        let out = &mut self.containers;
        writeln!(out, "      <SequenceContainer name=\"{name}\">").unwrap();
        if parameters.is_empty() {
            writeln!(out, "        <EntryList/>").unwrap();
        } else {
            writeln!(out, "        <EntryList>").unwrap();
            for Parameter { name, .. } in parameters {
                writeln!(out, "          <ParameterRefEntry parameterRef=\"{name}\"/>").unwrap();
            }
            writeln!(out, "        </EntryList>").unwrap();
        }
        writeln!(out, "        <BaseContainer containerRef=\"{base}\">").unwrap();
        writeln!(out, "          <RestrictionCriteria>\n            <ComparisonList>").unwrap();
        for (parameter, operator, value) in wanted {
            writeln!(
                out,
                "              <Comparison parameterRef=\"{parameter}\" comparisonOperator=\"{operator}\" value=\"{value}\"/>"
            )
            .unwrap();
        }
        writeln!(out, "            </ComparisonList>\n          </RestrictionCriteria>").unwrap();
        writeln!(out, "        </BaseContainer>\n      </SequenceContainer>").unwrap();
    }

    fn unsigned(&mut self, bits: usize, unit: &str) -> String {
        let name = named(&format!("u{bits}"), unit);
        let text = format!(
            "      <IntegerParameterType name=\"{name}\" signed=\"false\" sizeInBits=\"{bits}\">\n        {}\n        \
             <IntegerDataEncoding sizeInBits=\"{bits}\" encoding=\"unsigned\"/>\n      </IntegerParameterType>\n",
            unit_set(unit)
        );
        self.types.insert(name.clone(), text);
        name
    }

    fn float(&mut self, unit: &str) -> String {
        let name = named("f32", unit);
        let text = format!(
            "      <FloatParameterType name=\"{name}\" sizeInBits=\"32\">\n        {}\n        <FloatDataEncoding \
             sizeInBits=\"32\" encoding=\"IEEE754_1985\"/>\n      </FloatParameterType>\n",
            unit_set(unit)
        );
        self.types.insert(name.clone(), text);
        name
    }

    fn flag(&mut self) -> String {
        let text = "      <BooleanParameterType name=\"flag\">\n        <UnitSet/>\n        <IntegerDataEncoding \
                    sizeInBits=\"8\" encoding=\"unsigned\"/>\n      </BooleanParameterType>\n";
        self.types.insert("flag".to_owned(), text.to_owned());
        "flag".to_owned()
    }

    fn bytes(&mut self, len: usize) -> String {
        let name = format!("bytes{len}");
        let text = format!(
            "      <BinaryParameterType name=\"{name}\">\n        <UnitSet/>\n        <BinaryDataEncoding>\n          \
             <SizeInBits>\n            <FixedValue>{}</FixedValue>\n          </SizeInBits>\n        \
             </BinaryDataEncoding>\n      </BinaryParameterType>\n",
            8 * len
        );
        self.types.insert(name.clone(), text);
        name
    }

    /// One byte with a label for each value: readers differ in what they do with a value that has none.
    fn enumeration(&mut self, name: &str, label: impl Fn(u8) -> String) -> String {
        let mut text = format!(
            "      <EnumeratedParameterType name=\"{name}\">\n        <UnitSet/>\n        <IntegerDataEncoding \
             sizeInBits=\"8\" encoding=\"unsigned\"/>\n        <EnumerationList>\n"
        );
        for value in 0..=u8::MAX {
            writeln!(text, "          <Enumeration value=\"{value}\" label=\"{}\"/>", label(value)).unwrap();
        }
        text.push_str("        </EnumerationList>\n      </EnumeratedParameterType>\n");
        self.types.insert(name.to_owned(), text);
        name.to_owned()
    }
}

fn named(kind: &str, unit: &str) -> String {
    let path = names::path(kind, unit);
    path.concat()
}

fn unit_set(unit: &str) -> String {
    if unit.is_empty() { "<UnitSet/>".to_owned() } else { format!("<UnitSet><Unit>{unit}</Unit></UnitSet>") }
}

/// A packet of this type with every list as long as it can be, and the bytes of its payload.
fn longest(packet_type: u8) -> Option<(Downlink, usize)> {
    let mut payload = [0; DOWN_PAYLOAD_MAX];
    if packet_type == down_type::EVENT_REPORT {
        payload[0] = EventReport::MAX as u8;
    }
    (0..=payload.len()).rev().find_map(|len| {
        let packet = Downlink::decode(packet_type, &payload[..len]).ok()?;
        (!matches!(packet, Downlink::Unknown { .. })).then_some((packet, len))
    })
}

/// The fields of a packet with the list entry they belong to.
fn fields(document: &mut Document, packet: &Downlink) -> Vec<(Option<u8>, Parameter)> {
    let mut out = Vec::new();
    let prefix = names::snake(packet.name());
    // Chunks are no telemetry: the archive has no values of them.
    let archived = !matches!(packet, Downlink::ImageChunk(_));
    packet.visit_fields(&mut |field| {
        let mut path = names::path(field.name, field.unit);
        if let Some(index) = field.index {
            path.insert(1, index.to_string());
        }
        let bits = 8 * usize::from(field.len);
        let type_name = match (packet, field.name, field.value) {
            (Downlink::Error(_), "code", _) => {
                document.enumeration("error_code", |code| ErrorCode(code).to_string())
            }
            (Downlink::AdcsInfo(info), "mode", _) => {
                document.enumeration("adcs_mode", |mode| AdcsInfo { mode, ..*info }.adcs_mode().to_string())
            }
            (_, _, FieldValue::F32(_)) => document.float(field.unit),
            (_, _, FieldValue::U(_)) => document.unsigned(bits, field.unit),
            (_, _, FieldValue::Bool(_)) => document.flag(),
            (_, _, FieldValue::Bytes(bytes)) => document.bytes(bytes.len()),
        };
        let alias = format!("{}.{}", packet.name().to_ascii_lowercase(), field.name);
        let alias = archived.then_some(alias);
        out.push((field.index, Parameter { name: format!("{prefix}_{}", path.join("_")), alias, type_name }));
    });
    out
}

/// The file.
pub(crate) fn document() -> String {
    let mut document = Document::default();
    document.types.insert(
        "magic".to_owned(),
        format!(
            "      <StringParameterType name=\"magic\">\n        <UnitSet/>\n        <StringDataEncoding \
             encoding=\"US-ASCII\">\n          <SizeInBits>\n            <Fixed>\n              \
             <FixedValue>{}</FixedValue>\n            </Fixed>\n          </SizeInBits>\n        \
             </StringDataEncoding>\n      </StringParameterType>\n",
            8 * protocol::MAGIC_LEN
        ),
    );
    let header: [(&str, String); 5] = [
        ("magic", "magic".to_owned()),
        ("crc32", document.unsigned(32, "")),
        ("packet_type", document.unsigned(8, "")),
        ("tag", document.unsigned(8, "")),
        ("length", document.unsigned(16, "B")),
    ];
    let mut entries = String::new();
    for (name, type_name) in header {
        document.parameter(&Parameter { name: name.to_owned(), alias: None, type_name });
        writeln!(entries, "          <ParameterRefEntry parameterRef=\"{name}\"/>").unwrap();
    }
    write!(
        document.containers,
        "      <SequenceContainer name=\"received\" shortDescription=\"Anything that begins like a frame\">\n        \
         <EntryList>\n{entries}        </EntryList>\n      </SequenceContainer>\n      <SequenceContainer \
         name=\"frame\" shortDescription=\"A frame of PixelSat; its payload begins at byte {SHORT_OVERHEAD}\">\n        \
         <EntryList/>\n        <BaseContainer containerRef=\"received\">\n          <RestrictionCriteria>\n            \
         <Comparison parameterRef=\"magic\" value=\"PIXELSAT\"/>\n          </RestrictionCriteria>\n        \
         </BaseContainer>\n      </SequenceContainer>\n"
    )
    .unwrap();

    for (packet, len) in (0..=u8::MAX).filter_map(longest) {
        let name = names::snake(packet.name());
        let packet_type = usize::from(packet.packet_type());
        let fields = fields(&mut document, &packet);
        let events =
            usize::from(fields.iter().filter_map(|(index, _)| *index).max().map_or(0, |last| last + 1));
        let (single, listed): (Vec<_>, Vec<_>) = fields.into_iter().partition(|(index, _)| index.is_none());
        let single: Vec<Parameter> = single.into_iter().map(|(_, parameter)| parameter).collect();
        if events == 0 {
            let wanted = [("packet_type", "==", packet_type), ("length", "==", len)];
            document.container(&name, "frame", &wanted, &single);
            continue;
        }
        // A list: each entry is a container on top of the one before, so that no reader needs to know repetition.
        document.container(
            &name,
            "frame",
            &[("packet_type", "==", packet_type), ("length", ">=", 1)],
            &single,
        );
        let (mut base, mut listed) = (name.clone(), listed.into_iter().peekable());
        let each = (len - 1) / events;
        for event in 0..events {
            let mut entry = Vec::new();
            while let Some((_, parameter)) =
                listed.next_if(|(index, _)| index.map(usize::from) == Some(event))
            {
                entry.push(parameter);
            }
            let (container, behind) = (format!("{name}_{}", event + 1), 1 + each * (event + 1));
            let count = format!("{name}_count");
            document.container(
                &container,
                &base,
                &[(&count, ">=", event + 1), ("length", ">=", behind)],
                &entry,
            );
            base = container;
        }
    }
    let types: String = document.types.into_values().collect();
    let (parameters, containers) = (document.parameters, document.containers);
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>
<!-- Made by the tests of the protocol crate from the tables of the code; do not edit. -->
<SpaceSystem name=\"PixelSat-I\" xmlns=\"{NAMESPACE}\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
         xsi:schemaLocation=\"{NAMESPACE} https://www.omg.org/spec/XTCE/20180204/SpaceSystem.xsd\" \
         shortDescription=\"The downlink of the CubeSat PixelSat I\">
  <LongDescription>One frame from its magic on; bytes that a radio module puts before it are to be taken away first. \
         Check the CRC-32 (ISO-HDLC) before: in a short frame it covers the bytes from 12 to 16 + length, in a full one \
         those from 12 to 240. A payload of an unknown type or length has no container and stays raw. Meanings: \
         docs/icd.md.</LongDescription>
  <Header validationStatus=\"Draft\"/>
  <TelemetryMetaData>
    <ParameterTypeSet>
{types}    </ParameterTypeSet>
    <ParameterSet>
{parameters}    </ParameterSet>
    <ContainerSet>
{containers}    </ContainerSet>
  </TelemetryMetaData>
</SpaceSystem>
"
    )
}
