// SPDX-License-Identifier: MIT
// MCAP files (https://mcap.dev/spec) in memory. Chunks are not compressed, and have no CRC (0).
import {ByteWriter} from './byte_writer.js';

const magic = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
const op = {
    header: 1,
    footer: 2,
    schema: 3,
    channel: 4,
    message: 5,
    chunk: 6,
    messageIndex: 7,
    chunkIndex: 8,
    statistics: 11,
    metadata: 12,
    metadataIndex: 13,
    summaryOffset: 14,
    dataEnd: 15
};
const chunkBytes = 1 << 20;

/** A file. Times are ns of Unix time as bigint. */
export class McapWriter {
    constructor() {
        this.file = new ByteWriter();
        this.schemas = [];   // contents of the records
        this.channels = [];
        this.counts = [];    // messages of each channel
        this.chunks = [];
        this.chunk = null;
        this.file.bytes(magic);
        this.record(this.file, op.header, to => {
            to.text('');
            to.text('halcyon');
        });
    }

    /// Appends a record whose content is written by `fill`.
    record(to, opcode, fill) {
        to.uint8(opcode);
        const at = to.size;
        to.uint64(0n);
        fill(to);
        to.uint64At(at, BigInt(to.size - at - 8));
    }

    addSchema(name, encoding, data) {
        const id = this.schemas.length + 1;
        this.schemas.push(to => {
            to.uint16(id);
            to.text(name);
            to.text(encoding);
            to.text(data);
        });
        return id;
    }

    addChannel(schema, topic, encoding, metadata) {
        const id = this.channels.length + 1;
        this.channels.push(to => {
            to.uint16(id);
            to.uint16(schema);
            to.text(topic);
            to.text(encoding);
            to.map(metadata);
        });
        this.counts.push(0);
        return id;
    }

    metadata(name, entries) {
        const offset = this.file.size;
        this.record(this.file, op.metadata, to => {
            to.text(name);
            to.map(entries);
        });
        this.metadataAt = {name, offset, length: this.file.size - offset};
    }

    /// Appends a message; messages come in the order of time.
    message(channel, sequence, time, fill) {
        if (this.chunk && this.chunk.to.size > chunkBytes) this.flush();
        this.chunk ??= this.begin(time);
        const {to, index} = this.chunk;
        this.chunk.end = time;
        if (!index.has(channel)) index.set(channel, []);
        index.get(channel).push([time, to.size]);
        this.counts[channel - 1]++;
        this.record(to, op.message, record => {
            record.uint16(channel);
            record.uint32(sequence >>> 0);
            record.uint64(time);
            record.uint64(time);
            fill(record);
        });
    }

    /// A chunk can be read by itself: it begins with all schemas and channels.
    begin(time) {
        const to = new ByteWriter();
        for (const fill of this.schemas)
            this.record(to, op.schema, fill);
        for (const fill of this.channels)
            this.record(to, op.channel, fill);
        return {to, begin: time, end: time, index: new Map()};
    }

    flush() {
        if (!this.chunk) return;
        const {file} = this, {to, begin, end, index} = this.chunk, offset = file.size,
              size = BigInt(to.size);
        this.record(file, op.chunk, record => {
            record.uint64(begin);
            record.uint64(end);
            record.uint64(size);
            record.uint32(0);
            record.text('');
            record.uint64(size);
            record.append(to);
        });
        const length = file.size - offset, offsets = new Map();
        for (const [channel, entries] of index) {
            offsets.set(channel, file.size);
            this.record(file, op.messageIndex, record => {
                record.uint16(channel);
                record.uint32(16 * entries.length);
                for (const [time, at] of entries) {
                    record.uint64(time);
                    record.uint64(BigInt(at));
                }
            });
        }
        const indexLength = file.size - offset - length;
        this.chunks.push({begin, end, offset, length, offsets, indexLength, size});
        this.chunk = null;
    }

    /// Completes the file.
    close() {
        this.flush();
        const {file} = this;
        this.record(file, op.dataEnd, to => to.uint32(0));
        const begin = file.size, groups = [];
        const group = (opcode, fills) => {
            const from = file.size;
            for (const fill of fills)
                this.record(file, opcode, fill);
            if (file.size > from) groups.push([opcode, from, file.size - from]);
        };
        group(op.schema, this.schemas);
        group(op.channel, this.channels);
        group(op.statistics, [to => this.statistics(to)]);
        group(op.chunkIndex, this.chunks.map(one => to => this.chunkIndex(to, one)));
        group(op.metadataIndex, this.metadataAt ? [to => this.metadataIndex(to)] : []);
        const offsets = file.size;
        for (const [opcode, from, length] of groups)
            this.record(file, op.summaryOffset, to => {
                to.uint8(opcode);
                to.uint64(BigInt(from));
                to.uint64(BigInt(length));
            });
        this.record(file, op.footer, to => {
            to.uint64(BigInt(begin));
            to.uint64(BigInt(offsets));
            to.uint32(0);
        });
        file.bytes(magic);
        return file.done();
    }

    statistics(to) {
        const {chunks, counts} = this;
        to.uint64(BigInt(counts.reduce((sum, count) => sum + count, 0)));
        to.uint16(this.schemas.length);
        to.uint32(this.channels.length);
        to.uint32(0);  // attachments
        to.uint32(this.metadataAt ? 1 : 0);
        to.uint32(chunks.length);
        to.uint64(chunks[0]?.begin ?? 0n);
        to.uint64(chunks[chunks.length - 1]?.end ?? 0n);
        to.uint32(10 * counts.length);
        counts.forEach((count, i) => {
            to.uint16(i + 1);
            to.uint64(BigInt(count));
        });
    }

    chunkIndex(to, {begin, end, offset, length, offsets, indexLength, size}) {
        to.uint64(begin);
        to.uint64(end);
        to.uint64(BigInt(offset));
        to.uint64(BigInt(length));
        to.uint32(10 * offsets.size);
        for (const [channel, at] of offsets) {
            to.uint16(channel);
            to.uint64(BigInt(at));
        }
        to.uint64(BigInt(indexLength));
        to.text('');
        to.uint64(size);
        to.uint64(size);
    }

    metadataIndex(to) {
        const {name, offset, length} = this.metadataAt;
        to.uint64(BigInt(offset));
        to.uint64(BigInt(length));
        to.text(name);
    }
}
