// SPDX-License-Identifier: MIT
// A device description becomes the description of an object dictionary.
#include "components/canopen/eds/eds_dictionary.hpp"
#include "eds_text.hpp"

namespace hal::canopen::eds::test {
namespace {

TEST(EdsDictionary, Entries_have_type_right_value_and_limits) {
    const std::string text = motor(
        variable("2000", "0x3", "LowLimit=-5\nHighLimit=5\nDefaultValue=-1\nParameterValue=3\n") +
            variable("2001", "7", "DefaultValue=$NODEID+0x180\n") + variable("2002", "0x99", "") +
            "[2003]\nParameterName=in\nDataType=0x8\nAccessType=rwr\nPDOMapping=1\nHighLimit=1.5\n",
        "", "2000 2001 2002 2003");
    const DeviceDescription d = *read_eds(text).description;
    Description made = dictionary_of(d);
    const EntryDescription& value = *made.find(0x2000, 0);
    EXPECT_EQ(value.type, Type::integer16);
    EXPECT_EQ(value.access, hal::canopen::Access::read_write);
    EXPECT_EQ(value.value, (std::vector<std::uint8_t>{0xFF, 0xFF}));
    EXPECT_TRUE(value.ranged);
    EXPECT_EQ(value.low, -5);
    EXPECT_EQ(value.high, 5);
    EXPECT_TRUE(made.find(0x2001, 0)->plus_node_id);
    EXPECT_EQ(made.find(0x2001, 0)->value, (std::vector<std::uint8_t>{0x80, 1, 0, 0}));
    EXPECT_EQ(made.find(0x2002, 0), nullptr);
    const EntryDescription& in = *made.find(0x2003, 0);
    EXPECT_TRUE(in.tpdo && !in.rpdo && in.ranged);
    EXPECT_EQ(std::bit_cast<double>(in.high), 1.5);
    EXPECT_EQ(made.find(0x1018, 0)->access, hal::canopen::Access::constant);
    EXPECT_EQ(dictionary_of(d, true).find(0x2000, 0)->value, (std::vector<std::uint8_t>{3, 0}));
}

}  // namespace
}  // namespace hal::canopen::eds::test
