// SPDX-License-Identifier: MIT
// From a DCF to the writes that configure a node.
#include "components/canopen/eds/concise_dcf.hpp"
#include "eds_text.hpp"

namespace hal::canopen::eds::test {
namespace {

std::string tpdo(const std::string& cob, const std::string& mapped) {
    return "[1800]\nParameterName=c\nObjectType=9\nSubNumber=3\n[1800sub0]\nParameterName="
           "n\nDataType=5\nAccessType=const\nDefaultValue=2\n"
           "[1800sub1]\nParameterName=cob\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+"
           "0x180\n" +
           cob +
           "[1800sub2]\nParameterName=type\nDataType=5\nAccessType=rw\nDefaultValue="
           "255\nParameterValue=1\n"
           "[1A00]\nParameterName=m\nObjectType=9\nSubNumber=2\n[1A00sub0]\nParameterName="
           "n\nDataType=5\nAccessType=rw\nDefaultValue=1\n"
           "[1A00sub1]\nParameterName=o\nDataType=7\nAccessType=rw\nDefaultValue=0x10010008\n" +
           mapped;
}
const std::string node_5 = "[DeviceComissioning]\nNodeID=5\nBaudrate=1000\n";

std::string written(const Configuration& configuration) {
    std::string text;
    for (const Write& write : configuration.writes) {
        char head[16];
        std::snprintf(head, sizeof head, "%04X:%X=", write.index, write.sub);
        text += head + spell(write.data, 0x0A) + "; ";
    }
    return text;
}

TEST(EdsConcise, Only_what_differs_is_written) {
    const std::string text =
        motor(node_5 + variable("2000", "6", "DefaultValue=16\nParameterValue=0x10\n") +
                  variable("2001", "6", "DefaultValue=1\nParameterValue=2\n") +
                  variable("2002", "6", "DefaultValue=1\n"),
              "", "2000 2001 2002");
    const DeviceDescription d = *read_eds(text).description;
    EXPECT_EQ(written(configuration_of(d)), "2001:0=02 00; ");
    EXPECT_EQ(written(configuration_of(d, 0, true)), "2000:0=10 00; 2001:0=02 00; ");
}

TEST(EdsConcise, A_dcf_is_for_its_node_and_its_bit_rate) {
    DeviceDescription d = *read_eds(motor(node_5)).description;
    d.commissioning->baud_rate = 250;
    EXPECT_EQ(misfit(d, 5, 250'000), "");
    EXPECT_EQ(misfit(d, 5, 0), "") << "an unknown bit rate";
    EXPECT_EQ(misfit(d, 6, 250'000), "it is for node 5, not for node 6");
    EXPECT_EQ(misfit(d, 5, 1'000'000), "it is for a bus of 250 kbit/s, not of 1000 kbit/s");
    d.commissioning->baud_rate = 0;
    d.commissioning->node_id = 0;
    EXPECT_EQ(misfit(d, 6, 1'000'000), "") << "neither is stated";
    d.commissioning.reset();
    EXPECT_EQ(misfit(d, 6, 1'000'000), "") << "an EDS";
}

TEST(EdsConcise, A_pdo_is_switched_off_while_it_changes) {
    const DeviceDescription d =
        *read_eds(motor(node_5 + tpdo("", "ParameterValue=0x10000020\n"), "1800 1A00")).description;
    EXPECT_EQ(written(configuration_of(d)),
              "1800:1=85 01 00 80; 1A00:0=00; 1A00:1=20 00 00 10; 1A00:0=01; 1800:2=01; 1800:1=85 "
              "01 00 00; ");
    EXPECT_EQ(written(configuration_of(d, 7)).substr(0, 20), "1800:1=87 01 00 80; ");
}

TEST(EdsConcise, A_pdo_that_is_to_stay_off_stays_off) {
    const DeviceDescription d =
        *read_eds(motor(node_5 + tpdo("ParameterValue=0x80000000\n", ""), "1800 1A00")).description;
    EXPECT_EQ(written(configuration_of(d)), "1800:1=00 00 00 80; 1800:2=01; ");
}

TEST(EdsConcise, What_cannot_be_written_is_said) {
    const std::string text = motor(
        "[2000]\nParameterName=x\nDataType=5\nAccessType=ro\nDefaultValue=1\nParameterValue=2\n" +
            variable("2001", "5", "ParameterValue=300\n") +
            variable("2002", "7", "DefaultValue=1\nParameterValue=$NODEID+2\n"),
        "", "2000 2001 2002");
    const Configuration configuration = configuration_of(*read_eds(text).description);
    EXPECT_TRUE(configuration.writes.empty());
    ASSERT_EQ(configuration.messages.size(), 3u);
    EXPECT_NE(to_string(configuration.messages[0]).find("it is ro"), std::string::npos);
    EXPECT_NE(to_string(configuration.messages[1]).find("'300' does not fit"), std::string::npos);
    EXPECT_NE(to_string(configuration.messages[2]).find("no node-id is given"), std::string::npos);
}

TEST(EdsConcise, The_block_of_bytes_is_that_of_1F22) {
    const std::vector<Write> writes{{0x1017, 0, {0xE8, 0x03}}, {0x2000, 1, {}}};
    const std::vector<std::uint8_t> bytes = concise(writes);
    EXPECT_EQ(bytes, (std::vector<std::uint8_t>{2, 0,    0,    0,    0x17, 0x10, 0, 2, 0, 0,
                                                0, 0xE8, 0x03, 0x00, 0x20, 1,    0, 0, 0, 0}));
    EXPECT_EQ(parse_concise(bytes), writes);
    for (std::size_t n = 0; n < bytes.size(); ++n) {
        EXPECT_FALSE(parse_concise(std::span(bytes).first(n))) << n;
    }
    std::vector<std::uint8_t> more = bytes;
    more.push_back(0);
    EXPECT_FALSE(parse_concise(more));
    EXPECT_FALSE(parse_concise(std::vector<std::uint8_t>(4, 0xFF)));
}

}  // namespace
}  // namespace hal::canopen::eds::test
