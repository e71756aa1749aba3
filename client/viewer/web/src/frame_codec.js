// Topologies and frames from the bytes of common/frame_codec.h, version 2, not compressed. The table there is the
// reference; `Reader` follows its field types.
const MODELS = ['rigid', 'fixed', 'fem', 'example_based'];
const HEADER = 16;
const NO_BASE = 0xffffffff;

class Reader {
  constructor(buffer) {
    this.view = new DataView(buffer);
    this.buffer = buffer;
    this.at = 0;
  }
  u8() { return this.view.getUint8(this.at++); }
  u16() { this.at += 2; return this.view.getUint16(this.at - 2, true); }
  u32() { this.at += 4; return this.view.getUint32(this.at - 4, true); }
  u64() { this.at += 8; return Number(this.view.getBigUint64(this.at - 8, true)); }
  f32() { this.at += 4; return this.view.getFloat32(this.at - 4, true); }
  f64() { this.at += 8; return this.view.getFloat64(this.at - 8, true); }
  floats(n) { return Array.from({ length: n }, () => this.f32()); }
  pad() { this.at = (this.at + 3) & ~3; }
  array(Type, n) {
    const values = new Type(this.buffer, this.at, n);
    this.at += n * Type.BYTES_PER_ELEMENT;
    this.pad();
    return values;
  }
  text() {
    const bytes = this.array(Uint8Array, this.u32());
    return new TextDecoder().decode(bytes);
  }
  // n vertices as Float32Array x0 y0 z0 x1 ..., or null for none.
  positions(n, quantised) {
    if (n === 0) return null;
    if (!quantised) return this.array(Float32Array, 3 * n);
    const low = this.floats(3);
    const size = this.floats(3);
    const steps = this.array(Uint16Array, 3 * n);
    const values = new Float32Array(3 * n);
    for (let i = 0; i < values.length; ++i) values[i] = low[i % 3] + size[i % 3] * steps[i] / 65535;
    return values;
  }
}

// {kind: 'topology' | 'frame', ...}; throws on bytes of another format.
export function decode(buffer) {
  const reader = new Reader(buffer);
  const magic = String.fromCharCode(...reader.array(Uint8Array, 4));
  const version = reader.u8();
  const kind = reader.u8();
  const quantised = reader.u8() === 0;
  const compressed = reader.u8() !== 0;
  if (magic !== 'CRFC' || version !== 2 || compressed) throw new Error(`cannot read ${magic} version ${version}`);
  reader.at = HEADER;
  return kind === 1 ? topology(reader, quantised) : frame(reader, quantised);
}

function topology(reader, quantised) {
  const result = { kind: 'topology', epoch: reader.u32(), base: reader.u32(), part: reader.u32(), parts: reader.u32(), bodies: [] };
  if (result.base === NO_BASE) result.base = null;
  const count = reader.u32();
  for (let i = 0; i < count; ++i) {
    const body = { id: reader.u32(), model: MODELS[reader.u8()], deformable: reader.u8() !== 0 };
    const channels = reader.u16();
    body.colour = reader.floats(3);
    body.opacity = reader.f32();
    const vertices = reader.u32();
    const triangles = reader.u32();
    body.epoch = reader.u32();
    body.name = reader.text();
    body.channels = Array.from({ length: channels }, () => reader.text());
    body.vertices = reader.positions(vertices, quantised) ?? new Float32Array(0);
    body.triangles = reader.array(Uint32Array, 3 * triangles);
    result.bodies.push(body);
  }
  return result;
}

function frame(reader, quantised) {
  const result = { kind: 'frame', step: reader.u64(), time: reader.f64(), stepMs: reader.f64(),
    realTimeFactor: reader.f64(), epoch: reader.u32(), bodies: [] };
  const count = reader.u32();
  for (let i = 0; i < count; ++i) {
    const id = reader.u32();
    const positions = reader.u32();
    const values = reader.u32();
    const pose = { quaternion: reader.floats(4), position: reader.floats(3) };
    result.bodies.push({ id, pose, positions: reader.positions(positions, quantised),
      values: values === 0 ? null : bodyValues(reader, values, quantised) });
  }
  return result;
}

function bodyValues(reader, count, quantised) {
  if (!quantised) return reader.array(Float32Array, count);
  return Float32Array.from(reader.array(Uint8Array, count), (step) => step / 255);
}
