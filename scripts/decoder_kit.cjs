// Compiles KIT/pixelsat.ksy to JavaScript and Python in OUT, decodes every packet of KIT/frames.json in JavaScript, and
// compares field by field. Called by scripts/decoder-kit.
'use strict';
const fs = require('fs');
const path = require('path');
const compiler = require('kaitai-struct-compiler');
const { parse } = require('yaml');
const KaitaiStream = require('kaitai-struct/KaitaiStream');

const [kit, out] = process.argv.slice(2);

// CRC-32/ISO-HDLC, by hand: not every node has zlib.crc32.
function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

const camel = (name) => name.replace(/_([a-z0-9])/g, (_, letter) => letter.toUpperCase());
const hex = (bytes) => Buffer.from(bytes).toString('hex');

// A value as frames.json writes it. Numbers that stand there as text come back as this language's numbers.
function same(found, wanted) {
  if (found instanceof Uint8Array) return hex(found) === wanted;
  return Object.is(found, typeof wanted === 'string' ? Number(wanted) : wanted);
}

const shown = (value) => (value instanceof Uint8Array ? hex(value) : String(value));

// Every field that is wanted is there with its value, and no other is.
function compare(found, wanted, place, differ) {
  if (Array.isArray(wanted)) {
    if (!Array.isArray(found) || found.length !== wanted.length) return differ(place, found, `${wanted.length} entries`);
    return wanted.reduce((count, entry, index) => count + compare(found[index], entry, `${place}[${index}]`, differ), 0);
  }
  if (wanted !== null && typeof wanted === 'object') {
    const names = Object.keys(wanted).map(camel);
    const own = Object.keys(found ?? {}).filter((name) => !name.startsWith('_'));
    for (const name of own) if (!names.includes(name)) differ(`${place}.${name}`, found[name], 'no such field');
    return Object.entries(wanted).reduce(
      (count, [name, value]) => count + compare(found?.[camel(name)], value, `${place}.${name}`, differ), 0);
  }
  if (!same(found, wanted)) differ(place, found, wanted);
  return 1;
}

async function main() {
  const ksy = parse(fs.readFileSync(path.join(kit, 'pixelsat.ksy'), 'utf8'));
  for (const language of ['javascript', 'python']) {
    const files = await compiler.compile(language, ksy, null, false);
    for (const [name, text] of Object.entries(files)) fs.writeFileSync(path.join(out, name), text);
  }
  const { Pixelsat } = require(path.join(out, 'Pixelsat.js'));
  const { frames } = JSON.parse(fs.readFileSync(path.join(kit, 'frames.json'), 'utf8'));
  let fields = 0;
  let differences = 0;
  for (const frame of frames) {
    const differ = (place, found, wanted) => {
      differences += 1;
      console.error(`javascript: ${frame.name}: ${place} is ${shown(found)}, expected ${wanted}`);
      return 0;
    };
    const is = (place, found, wanted) => {
      fields += compare(found, wanted, place, differ);
    };
    const bytes = Buffer.from(frame.hex, 'hex');
    let packet = null;
    try {
      packet = new Pixelsat(new KaitaiStream(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length)));
    } catch (error) {
      if (frame.ours) differ('the packet', `refused (${error.message})`, 'ours');
    }
    if (packet === null) continue;
    if (!frame.ours) {
      differ('the packet', 'accepted', 'refused');
      continue;
    }
    const enumName = (names, value) => names[value]?.toLowerCase() ?? null;
    const crc = [packet.checkedShort, packet.checkedFull].filter((part) => part !== undefined).map(crc32);
    is('module_header', packet.moduleHeader, frame.module_header);
    is('crc32', packet.crc32.toString(16).padStart(8, '0') === frame.crc32, true);
    is('crc_ok', crc.includes(packet.crc32), frame.crc_ok);
    is('packet_type', packet.packetType, frame.packet_type);
    is('packet_type_name', enumName(Pixelsat.PacketType, packet.packetType) === frame.packet_type_name, true);
    is('tag', packet.tag, frame.tag);
    is('length', packet.length, frame.length);
    is('payload', packet.payload, frame.payload ?? frame.payload_raw);
    is('rest', packet.rest, frame.rest);
    is('tinygs_satellite', packet.tinygsSatellite === 'PixelSat-I', true);
    if ('code_name' in frame) is('code_name', enumName(Pixelsat.ErrorCode, packet.payload.code) === frame.code_name, true);
    if ('mode_name' in frame) is('mode_name', enumName(Pixelsat.AdcsMode, packet.payload.mode) === frame.mode_name, true);
    if (packet.payload instanceof Pixelsat.Heartbeat) is('tinygs_temp', packet.payload.tinygsTemp, frame.payload.temp_c);
  }
  console.log(`javascript: ${frames.length} packets, ${fields} values, ${differences} differ`);
  process.exitCode = differences > 0 || fields === 0 ? 1 : 0;
}

main().catch((error) => {
  console.error(`javascript: ${error.stack ?? error}`);
  process.exitCode = 1;
});
