// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {ByteWriter} from '../../tools/panel/page/byte_writer.js';

test('values are little-endian; texts and maps have their length before them', () => {
    const to = new ByteWriter();
    to.uint8(1);
    to.uint16(0x0302);
    to.uint32(4);
    to.text('é');
    to.map({a: 'b'});
    assert.deepEqual(
        [...to.done()],
        [1, 2, 3, 4, 0, 0, 0, 2, 0, 0, 0, 0xc3, 0xa9, 10, 0, 0, 0, 1, 0, 0, 0, 97, 1, 0, 0, 0, 98]);
});

test('it grows at every kind of value', () => {
    const puts = [
        [to => to.uint8(7), 1], [to => to.uint16(7), 2], [to => to.uint32(7), 4],
        [to => to.uint64(7n), 8], [to => to.float64(7), 8], [to => to.bytes([7, 7, 7]), 3]
    ];
    for (const [put, bytes] of puts) {
        const to = new ByteWriter(), count = 1 + Math.ceil((1 << 17) / bytes);
        for (let i = 0; i < count; i++)
            put(to);
        assert.equal(to.size, count * bytes);
        const all = to.done(), last = all.subarray(all.length - bytes);
        assert.deepEqual(last, all.subarray(0, bytes));
    }
});
