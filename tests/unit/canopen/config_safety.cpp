// SPDX-License-Identifier: MIT
// SRDOs in a configuration: the objects written to the node, and the messages for invalid SRDOs.
#include <gtest/gtest.h>

#include <algorithm>

#include "canopen/master/config/bus_schedule.hpp"
#include "canopen/master/config/master_config.hpp"
#include "canopen/protocol/srdo_description.hpp"

namespace hal::canopen::config {
namespace {

ReadResult read_node(const std::string& keys, const std::string& id = "7") {
    return read("[bus]\nlink = sim:x\n[node " + id + " gate]\n" + keys, "x.canopen");
}
const std::string pair = "0x2300:1 u8 / 0x2301:1 u8";

std::string first(const ReadResult& reading) {
    for (const Message& m : reading.messages) {
        if (m.severity == Severity::error) {
            return std::to_string(m.at.line) + ": " + m.sentence + "; " + m.help;
        }
    }
    return "";
}
std::uint32_t written(const ReadResult& reading, std::uint16_t index, std::uint8_t sub) {
    std::uint32_t value = 0xffffffff;
    for (const auto& w : reading.config.nodes.at(0).setup.writes) {
        if (w.index == index && w.sub == sub) {
            value = 0;

            std::copy_n(w.data.begin(), w.data.size(), reinterpret_cast<std::uint8_t*>(&value));
        }
    }
    return value;
}

TEST(ConfigSafety, Writes_parameters_mapping_signature_and_that_all_is_valid) {
    const auto r = read_node("tsrdo1 = " + pair + "\ntsrdo1.sct = 40ms\ntsrdo1.srvt = 10ms\n");
    ASSERT_TRUE(r.good()) << first(r);
    EXPECT_EQ(written(r, 0x1301, 1), 1U);
    EXPECT_EQ(written(r, 0x1301, 2), 20U) << "sent twice in the SCT";
    EXPECT_EQ(written(r, 0x1301, 3), 10U);
    EXPECT_EQ(written(r, 0x1301, 5), 0xffU + 14);
    EXPECT_EQ(written(r, 0x1301, 6), 0x100U + 14);
    EXPECT_EQ(written(r, 0x1381, 0), 2U);
    EXPECT_EQ(written(r, 0x1381, 1), 0x23000108U);
    EXPECT_EQ(written(r, 0x1381, 2), 0x23010108U);
    const SrdoDescription d{.direction = SrdoDirection::sends,
                            .cycle_ms = 20,
                            .validation_ms = 10,
                            .cob = 0x10d,
                            .mapping = {0x23000108, 0x23010108}};
    EXPECT_EQ(written(r, 0x13ff, 1), srdo_signature(d));
    EXPECT_EQ(r.config.nodes[0].setup.writes.back().index, 0x13fe);
    EXPECT_EQ(written(r, 0x13fe, 0), 0xa5U);
}

TEST(ConfigSafety, Received_ones_have_the_SCT_and_zero_as_their_safe_value) {
    const auto r = read_node("rsrdo2 = " + pair +
                             "\nrsrdo2.cob-id = 0x141\nrsrdo2.sct = 40ms\nrsrdo2.refresh = 10ms\n");
    ASSERT_TRUE(r.good()) << first(r);
    EXPECT_EQ(written(r, 0x1302, 1), 2U);
    EXPECT_EQ(written(r, 0x1302, 2), 40U);
    const Pdo& p = r.config.nodes[0].pdos.at(0);
    EXPECT_TRUE(p.to_node);
    ASSERT_TRUE(p.safety);
    EXPECT_EQ(p.safety->refresh, 10 * millisecond);
    EXPECT_EQ(p.objects.at(0).safe, 0U);
}

TEST(ConfigSafety, Both_frames_are_in_the_plan) {
    const auto r = read_node("tsrdo1 = " + pair + "\n");
    ASSERT_TRUE(r.good()) << first(r);
    const auto schedule = schedule_of(r.config, millisecond);
    for (const std::uint32_t id : {0x10dU, 0x10eU}) {
        const auto m = std::find_if(schedule.messages.begin(), schedule.messages.end(),
                                    [&](const auto& x) { return x.id == id; });
        ASSERT_NE(m, schedule.messages.end());
        EXPECT_EQ(m->period, 25 * millisecond);
        EXPECT_EQ(m->bytes, 1);
    }
}

TEST(ConfigSafety, Says_what_is_wrong) {
    const std::pair<std::string, const char*> rows[] = {
        {"tsrdo1 = 0x2300:1 u8\n",
         "4: invalid pair '0x2300:1 u8': expected an object and its inverted object; write OBJECT "
         "/ INVERTED, as in 0x2300:1 / 0x2301:1"},
        {"tsrdo1 = 0x2300:1 u8 / 0x2301:1 u16\n",
         "4: '0x2301:1 u16' cannot hold '0x2300:1 u8' inverted; both must have the same length"},
        {"tsrdo1 = 0x2300:1 u8 / 0x2300:1 u8\n",
         "4: '0x2300:1 u8' cannot hold '0x2300:1 u8' inverted; both are the same object"},
        {"tsrdo2 = " + pair + "\n",
         "4: tsrdo2 has no default identifier; assign a free odd one of 0x101..0x17F: "
         "tsrdo2.cob-id = 0x151"},
        {"tsrdo1 = " + pair + "\ntsrdo1.cob-id = 0x102\n",
         "5: invalid tsrdo1.cob-id '0x102'; write an odd identifier of 0x101..0x17F; the second "
         "frame has the next one"},
        {"tsrdo1 = " + pair + "\ntsrdo1.sct = 20ms\ntsrdo1.refresh = 20ms\n",
         "4: tsrdo1 always times out: it is sent every 20ms, its timeout is 20ms; write tsrdo1.sct "
         "= 40ms, or a shorter refresh"},
        {"tsrdo1 = " + pair + "\ntsrdo1.srvt = 256ms\n",
         "5: invalid tsrdo1.srvt '256ms'; write whole milliseconds up to 255ms"},
        {"tsrdo1 = " + pair + "\ntsrdo1.inhibit = 1ms\n",
         "5: unknown SRDO option 'inhibit'; the options are: refresh, sct, srvt, cob-id"},
        {"tsrdo65 = " + pair + "\n", "4: invalid SRDO number 65; SRDOs are numbered 1..64"},
        {"tsrdo1.sct = 20ms\n",
         "4: tsrdo1 has options but no objects; name its objects: tsrdo1 = OBJECT / INVERTED, "
         "OBJECT / INVERTED"},
        {"tsrdo1 = " + pair + "\nrsrdo1 = 0x2310:1 u8 / 0x2311:1 u8\n",
         "5: SRDO 1 of a node is either sent or received, not both; renumber one of them: rsrdo2"},
        {"tpdo1 = 0x2300:1 u8\ntpdo1.transmission = event\ntsrdo1 = " + pair + "\n",
         "6: object 0x2300:1 of tsrdo1 is also in another PDO or SRDO; map a safety-related object "
         "to one SRDO only"},
        {"tsrdo1 = " + pair + "\nrsrdo2 = 0x2310:1 u8 / 0x2311:1 u8\nrsrdo2.cob-id = 0x10d\n",
         "5: rsrdo2 of 'gate' and tsrdo1 of 'gate' have the same identifier 0x010d; an SRDO cannot "
         "share its identifiers"},
    };
    for (const auto& [keys, said] : rows) {
        EXPECT_EQ(first(read_node(keys)), said) << keys;
    }
}

TEST(ConfigSafety, Nodes_above_64_have_no_identifier_by_rule) {
    EXPECT_EQ(first(read_node("tsrdo1 = " + pair + "\n", "65")),
              "4: tsrdo1 has no default identifier; assign a free odd one of 0x101..0x17F: "
              "tsrdo1.cob-id = 0x151");
}

}  // namespace
}  // namespace hal::canopen::config
