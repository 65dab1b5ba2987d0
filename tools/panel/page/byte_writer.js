// SPDX-License-Identifier: MIT

/** Bytes that are written one after the other, little-endian; texts and maps as MCAP has them. */
export class ByteWriter {
    constructor() {
        this.buffer = new ArrayBuffer(1 << 16);
        this.size = 0;
        this.view = new DataView(this.buffer);
    }
    /// Returns where `count` bytes go. It may replace the view.
    claim(count) {
        const at = this.size, needed = at + count;
        if (needed > this.buffer.byteLength) {
            const larger = new Uint8Array(Math.max(needed, 2 * this.buffer.byteLength));
            larger.set(new Uint8Array(this.buffer, 0, at));
            this.buffer = larger.buffer;
            this.view = new DataView(this.buffer);
        }
        this.size = needed;
        return at;
    }
    uint8(value) {
        const at = this.claim(1);
        this.view.setUint8(at, value);
    }
    uint16(value) {
        const at = this.claim(2);
        this.view.setUint16(at, value, true);
    }
    uint32(value) {
        const at = this.claim(4);
        this.view.setUint32(at, value, true);
    }
    /** @param {bigint} value */
    uint64(value) {
        const at = this.claim(8);
        this.view.setBigUint64(at, value, true);
    }
    /// Replaces 8 bytes that were written.
    uint64At(at, value) { this.view.setBigUint64(at, value, true); }
    float64(value) {
        const at = this.claim(8);
        this.view.setFloat64(at, value, true);
    }
    bytes(values) {
        const at = this.claim(values.length);
        new Uint8Array(this.buffer).set(values, at);
    }
    /** @param {ByteWriter} other */
    append(other) { this.bytes(other.done()); }
    /// A text with its length in bytes before it.
    text(value) {
        const bytes = new TextEncoder().encode(value);
        this.uint32(bytes.length);
        this.bytes(bytes);
    }
    /// Keys and values with their length in bytes before them.
    map(entries) {
        const content = new ByteWriter();
        for (const [key, value] of Object.entries(entries)) {
            content.text(key);
            content.text(value);
        }
        this.uint32(content.size);
        this.append(content);
    }
    /// What was written.
    done() { return new Uint8Array(this.buffer, 0, this.size); }
}
