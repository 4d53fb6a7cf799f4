// What the page carries, and what a connection brings: JSON and blocks of bytes. In the page they are compressed (deflate) and written in 85 characters.

/** The parts of colours by their shade. */
const SHADES = Uint8Array.from({ length: 64 }, (_, shade) => Math.round((shade * 255) / 63));

/** The header `name`, or null where the page carries none. */
export function readHeader(name) {
  const holder = document.getElementById(`${name}-header`);
  return holder && JSON.parse(holder.textContent);
}

/** The bytes of a block. */
export async function readBlock(name) {
  return inflated(bytesOf(document.getElementById(`scene-${name}`).textContent));
}

/** The digits of the characters from `(` on, of which `<` and the backslash are none. */
const DIGITS = Uint8Array.from({ length: 128 }, (_, code) => code - 0x28 - (code > 0x3c) - (code > 0x5c));

/** Four bytes are five characters, digits of a number to the base of 85; of a last group of fewer bytes there is one character more than bytes. */
export function bytesOf(text) {
  const bytes = new Uint8Array(text.length - Math.ceil(text.length / 5));
  for (let from = 0, to = 0; from < text.length; from += 5) {
    let value = 0;
    for (let n = from; n < from + 5; n += 1) value = value * 85 + (n < text.length ? DIGITS[text.charCodeAt(n)] : 84);
    for (let shift = 24; shift >= 0 && to < bytes.length; shift -= 8, to += 1) bytes[to] = value >>> shift;
  }
  return bytes;
}

/** The bytes that were compressed. */
export async function inflated(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A block that holds JSON. */
export async function readJson(name) {
  return JSON.parse(new TextDecoder().decode(await readBlock(name)));
}

/** Reads numbers and planes of numbers from bytes, in order. Numbers are little-endian. */
export class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.numbers = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }

  take(length) {
    this.at += length;
    return this.bytes.subarray(this.at - length, this.at);
  }

  u16() {
    this.at += 2;
    return this.numbers.getUint16(this.at - 2, true);
  }

  u32() {
    this.at += 4;
    return this.numbers.getUint32(this.at - 4, true);
  }

  i32() {
    this.at += 4;
    return this.numbers.getInt32(this.at - 4, true);
  }

  f32() {
    this.at += 4;
    return this.numbers.getFloat32(this.at - 4, true);
  }

  /** A number of up to 32 bits, seven of them a byte, the lowest first; the upper bit says whether another byte follows. */
  varint() {
    let [value, shift, byte] = [0, 0, 0];
    do {
      byte = this.bytes[this.at];
      this.at += 1;
      value += (byte & 0x7f) * 2 ** shift;
      shift += 7;
    } while (byte & 0x80);
    return value;
  }

  /**
   * `count` numbers of 16 bits, written as the differences of neighbours: first the low bytes, then the high ones.
   * They go to `into[first + n * stride]`.
   */
  differences16(count, into, first = 0, stride = 1) {
    const low = this.take(count);
    const high = this.take(count);
    let value = 0;
    for (let n = 0; n < count; n += 1) {
      const folded = low[n] | (high[n] << 8);
      value = (value + ((folded >>> 1) ^ -(folded & 1))) & 0xffff;
      into[first + n * stride] = value;
    }
  }

  /**
   * The numbers of an image of 8 bits, written as the differences from what the neighbours to the left and above let expect: the median of
   * both and of their sum less the one between them.
   */
  image8(width, height) {
    const differences = this.take(width * height);
    const values = new Uint8Array(width * height);
    for (let at = 0; at < values.length; at += 1) {
      const [left, above] = [values[at - 1] ?? 0, values[at - width] ?? 0];
      let expected = at % width === 0 ? above : left;
      if (at >= width && at % width > 0) {
        const between = values[at - width - 1];
        expected = Math.max(Math.min(left, above), Math.min(Math.max(left, above), left + above - between));
      }
      values[at] = differences[at] + expected;
    }
    return values;
  }

  /** `count` colours: the three parts, of 8 bits each, which were written in 64 shades, red and blue as what they are more than green. */
  colours(count) {
    const [green, red, blue] = [0, 1, 2].map(() => this.differences8(count));
    for (let n = 0; n < count; n += 1) {
      for (const part of [red, blue]) part[n] = SHADES[(part[n] + green[n]) & 63];
      green[n] = SHADES[green[n]];
    }
    return [red, green, blue];
  }

  /** `count` numbers of 8 bits, written as the differences of neighbours. */
  differences8(count) {
    const differences = this.take(count);
    const values = new Uint8Array(count);
    let value = 0;
    for (let n = 0; n < count; n += 1) {
      value = (value + differences[n]) & 0xff;
      values[n] = value;
    }
    return values;
  }
}
