// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {rangeOf, typedValue} from '../../tools/panel/page/typed_value.js';

test('values of each type are read', () => {
    assert.deepEqual(typedValue('bit', ' True '), {value: true});
    assert.deepEqual(typedValue('bit', '0'), {value: false});
    assert.deepEqual(typedValue('float', '-1.5e3'), {value: -1500});
    assert.deepEqual(typedValue('s32', '-2147483648'), {value: '-2147483648'});
    assert.deepEqual(typedValue('u32', '+7'), {value: '7'});
    assert.deepEqual(typedValue('u64', '18446744073709551615'), {value: '18446744073709551615'});
});

test('a value beyond the limits of its type is rejected with them', () => {
    assert.equal(
        typedValue('s32', '2147483648').problem,
        '2147483648 is out of the range of s32: -2147483648 .. 2147483647');
    assert.equal(typedValue('u32', '-1').problem, '-1 is out of the range of u32: 0 .. 4294967295');
    assert.match(typedValue('s64', '9223372036854775808').problem, /out of the range of s64/);
    assert.equal(rangeOf('float'), '');
    assert.equal(rangeOf('u32'), '0 .. 4294967295');
});

test('what is no value is rejected with what to type', () => {
    assert.equal(typedValue('float', '1,5').problem, "'1,5' is not a number; write 1.5");
    assert.equal(typedValue('float', 'x').problem, "'x' is not a number");
    assert.equal(typedValue('float', 'Infinity').problem, "'Infinity' is not a number");
    assert.equal(typedValue('s32', '1.5').problem, "'1.5' is not an integer");
    assert.equal(typedValue('bit', 'yes').problem, "'yes' is not TRUE or FALSE");
    assert.equal(typedValue('float', ' ').problem, 'type a value');
});
