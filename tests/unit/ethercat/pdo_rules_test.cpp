// SPDX-License-Identifier: MIT
// What a device description allows of PDOs: Exclude, Mandatory, Fixed, numbers of entries, lengths.
#include "ethercat/config/pdo_rules.hpp"

#include <gtest/gtest.h>

namespace hal::ethercat::config {
namespace {

/// A PDO with one object of 16 bits for each sub-index of `subs`.
std::string pdo(const std::string& name, const std::string& attributes, const std::string& index,
                const std::string& subs, const std::string& more = {},
                const std::string& object = "7000") {
    std::string text =
        "<" + name + " " + attributes + "><Index>#x" + index + "</Index><Name>P</Name>" + more;
    for (const char sub : subs) {
        text += "<Entry><Index>#x" + object + "</Index><SubIndex>" + std::string(1, sub) +
                "</SubIndex><BitLen>16</BitLen><Name>Value " + sub +
                "</Name><DataType>UINT</DataType></Entry>";
    }
    return text + "</" + name + ">";
}

/// A dictionary with eight words at 7000, and with mappings of `entries` objects.
std::string dictionary(unsigned entries) {
    std::string text =
        "<Profile><Dictionary><DataTypes><DataType><Name>UINT</Name><BitSize>16</BitSize></"
        "DataType>"
        "<DataType><Name>A7</Name><BaseType>UINT</BaseType><BitSize>128</"
        "BitSize><ArrayInfo><LBound>1</LBound><Elements>8</Elements></"
        "ArrayInfo></DataType>"
        "<DataType><Name>T7</Name><BitSize>144</BitSize><SubItem><SubIdx>0</SubIdx><Name>n</"
        "Name><Type>USINT</Type><BitSize>8</"
        "BitSize><BitOffs>0</BitOffs></SubItem>"
        "<SubItem><Name>Elements</Name><Type>A7</Type><BitSize>128</BitSize><BitOffs>16</"
        "BitOffs><Flags><Access>rw</Access><PdoMapping>RT</"
        "PdoMapping></Flags></SubItem></DataType>";
    const std::string n = std::to_string(entries);
    const std::string bits = std::to_string(32 * entries);

    const std::string all = std::to_string(32 * entries + 16);
    text += "<DataType><Name>AM</Name><BaseType>UDINT</BaseType><BitSize>" + bits +
            "</BitSize><ArrayInfo><LBound>1</LBound><Elements>" + n +
            "</Elements></ArrayInfo></DataType><DataType><Name>TM</Name><BitSize>" + all +
            "</BitSize><SubItem><SubIdx>0</SubIdx><Name>n</Name><Type>USINT</Type><BitSize>8</"
            "BitSize><BitOffs>0</BitOffs></SubItem>"
            "<SubItem><Name>Elements</Name><Type>AM</Type><BitSize>" +
            bits +
            "</BitSize><BitOffs>16</BitOffs></SubItem></DataType></DataTypes><Objects>"
            "<Object><Index>#x7000</Index><Name>Values</Name><Type>T7</Type><BitSize>144</"
            "BitSize></Object>";
    for (const char* mapping : {"1600", "1601", "1602"}) {
        text += std::string("<Object><Index>#x") + mapping +
                "</Index><Name>Mapping</Name><Type>TM</Type><BitSize>" + all +
                "</BitSize></Object>";
    }
    return text + "</Objects></Dictionary></Profile>";
}

std::string device(const std::string& pdos,
                   const std::string& coe = "PdoAssign=\"1\" PdoConfig=\"1\"",
                   const std::string& profile = {}, const std::string& sm = {}) {
    return "<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device "
           "Physics=\"YY\"><Type "
           "ProductCode=\"2\">BOX</Type><Name>Box</Name>" +
           profile + "<Sm>MBoxOut</Sm><Sm>MBoxIn</Sm><Sm " + sm + ">Outputs</Sm><Sm>Inputs</Sm>" +
           pdos + "<Mailbox><CoE " + coe +
           "/></Mailbox></Device></Devices></Descriptions></EtherCATInfo>";
}

ReadResult with(const std::string& xml, const std::string& lines) {
    return read("[bus]\n[slave 0 a]\nesi = d.xml\n" + lines, "m.ethercat",
                [&](const std::string&, std::string& text) {
        text = xml;
        return true;
    });
}
std::string errors(const std::string& xml, const std::string& lines) {
    return to_string(with(xml, lines), "m.ethercat");
}

std::string assigned(const ReadResult& r) {
    std::string text;
    for (const auto& sm : r.buses.at(0).setup.slaves.at(0).sync_managers) {
        for (const auto& p : sm.pdos) {
            text += pdo_text(p.index) + (p.write_mapping ? "*" : "") +
                    std::to_string(p.entries.size()) + " ";
        }
    }
    return text;
}

TEST(PdoRules, An_exclusion_on_one_side_is_mutual) {
    const std::string pdos = pdo("RxPdo", "Sm=\"2\"", "1600", "1") +
                             pdo("RxPdo", "", "1601", "2", "<Exclude>#x1600</Exclude>");
    EXPECT_EQ(errors(device(pdos), "outputs = 1600 1601\n"),
              "m.ethercat:4:11: error: PDOs 1600 and 1601 of 'BOX' exclude each other; assign only "
              "one of them");
    EXPECT_EQ(errors(device(pdos), "outputs = 1601 1600\n"),
              "m.ethercat:4:11: error: PDOs 1601 and 1600 of 'BOX' exclude each other; assign only "
              "one of them");
    EXPECT_EQ(errors(device(pdos), "outputs = 1601\n"), "");
}

TEST(PdoRules, Objects_are_mapped_in_PDOs_that_do_not_exclude_each_other) {
    const std::string pdos = pdo("RxPdo", "Sm=\"2\"", "1600", "1") +
                             pdo("RxPdo", "", "1601", "2", "<Exclude>#x1600</Exclude>") +
                             pdo("RxPdo", "", "1602", "3");
    const ReadResult r =
        with(device(pdos), "entries-per-pdo = 2\noutputs = 7000:1 7000:2 7000:3\n");
    EXPECT_EQ(to_string(r, "m.ethercat"), "");
    EXPECT_EQ(assigned(r), "1600*2 1602*1 ") << "not 1601";
    EXPECT_EQ(errors(device(pdos),
                     "entries-per-pdo = 2\noutputs = 7000:1 7000:2 7000:3 7000:4 u16 7000:5 u16\n"),
              "m.ethercat:5:11: error: 5 objects do not fit in the PDOs of 'BOX': 1600 takes 2, "
              "1602 takes 2; leave out 1 of them, or "
              "raise entries-per-pdo");
}

TEST(PdoRules, The_dictionary_limits_the_objects_of_a_PDO) {
    const std::string pdos = pdo("RxPdo", "Sm=\"2\"", "1600", "1") + pdo("RxPdo", "", "1601", "2");
    const std::string xml = device(pdos, "PdoAssign=\"1\" PdoConfig=\"1\"", dictionary(3));
    const ReadResult r = with(xml, "outputs = 7000:1..5\n");
    EXPECT_EQ(to_string(r, "m.ethercat"), "");
    EXPECT_EQ(assigned(r), "1600*3 1601*2 ");
    EXPECT_EQ(errors(xml, "outputs = 7000:1..7\n"),
              "m.ethercat:4:11: error: 7 objects do not fit in the PDOs of 'BOX': 1600 takes 3, "
              "1601 takes 3; leave out 1 of them");
    EXPECT_EQ(errors(xml, "outputs = 7000:1..5\noutputs.pdo = 1601\n"),
              "m.ethercat:4:11: error: 5 objects do not fit in the PDOs of 'BOX': 1601 takes 3; "
              "leave out 2 of them");
    EXPECT_EQ(errors(xml, "outputs = 7000:1 7000:3\noutputs.pdo = 1605\n"),
              "m.ethercat:5:15: error: PDO 1605 of 'BOX' cannot be mapped; write outputs.pdo = "
              "1600, or delete the line");
}

TEST(PdoRules, A_mandatory_PDO_must_be_assigned) {
    const std::string pdos = pdo("RxPdo", "Mandatory=\"1\" Fixed=\"1\"", "1600", "1") +
                             pdo("RxPdo", "Fixed=\"1\"", "1601", "2") +
                             pdo("RxPdo", "", "1602", "3");
    EXPECT_EQ(assigned(with(device(pdos), "")), "16001 ")
        << "without a sync manager in the file, it has the first one of its direction";
    EXPECT_EQ(errors(device(pdos), "outputs = 1601\n"),
              "m.ethercat:4:11: error: PDO 1600 of 'BOX' must be assigned; write it as well: "
              "outputs = 1600");
    EXPECT_EQ(errors(device(pdos), "outputs = none\n"),
              "m.ethercat:4:11: error: PDO 1600 of 'BOX' must be assigned; write it as well: "
              "outputs = 1600");
    EXPECT_EQ(errors(device(pdos), "outputs = 1600 1601\n"), "");
    const ReadResult r = with(device(pdos), "outputs = 1600 7000:3 7000:2\n");
    EXPECT_EQ(to_string(r, "m.ethercat"), "");
    EXPECT_EQ(assigned(r), "16001 1602*2 ") << "fixed PDOs are not mapped";
}

TEST(PdoRules, A_device_without_PdoConfig_or_PdoAssign_keeps_its_PDOs) {
    const std::string pdos = pdo("RxPdo", "Sm=\"2\"", "1600", "12") + pdo("RxPdo", "", "1601", "3");
    EXPECT_EQ(errors(device(pdos, "PdoAssign=\"1\""), "outputs = 7000:2 7000:1\n"),
              "m.ethercat:4:11: error: the PDOs of 'BOX' are fixed: its description has no "
              "PdoConfig; delete the line, or assign PDOs: "
              "1600, 1601");
    EXPECT_EQ(errors(device(pdos, "PdoAssign=\"1\""), "outputs = 7000:1 7000:2\n"), "")
        << "this is 1600";
    EXPECT_EQ(errors(device(pdos, ""), "outputs = 1601\n"),
              "m.ethercat:4:11: error: the assignment of sync manager 2 of 'BOX' is fixed: 1600; "
              "write outputs = default");
    EXPECT_EQ(errors(device(pdos, ""), "outputs = 1600\n"), "");
}

TEST(PdoRules, A_sync_manager_has_a_largest_size) {
    const std::string pdos = pdo("RxPdo", "Sm=\"2\"", "1600", "123");
    EXPECT_EQ(errors(device(pdos, "PdoAssign=\"1\" PdoConfig=\"1\"", "", "MaxSize=\"5\""),
                     "outputs = 1600\n"),
              "m.ethercat:4:11: error: the objects have 6 bytes; sync manager 2 of 'BOX' takes 5; "
              "leave out objects");
}

TEST(PdoRules, An_entry_longer_than_its_object_is_a_warning) {
    std::string pdos = pdo("RxPdo", "Sm=\"2\"", "1600", "1");
    pdos.replace(pdos.find("<BitLen>16"), 10, "<BitLen>32");
    pdos.replace(pdos.find("<DataType>UINT"), 14, "<DataType>UDINT");
    const std::string xml = device(pdos, "PdoAssign=\"1\" PdoConfig=\"1\"", dictionary(3));
    EXPECT_EQ(errors(xml, "outputs = 1600\n"), "");
    const ReadResult reading = with(xml, "outputs = 1600\n");
    ASSERT_EQ(reading.messages.size(), 1U);
    EXPECT_EQ(reading.messages[0].severity, Severity::warning);
    EXPECT_EQ(reading.messages[0].sentence, "PDO 1600 maps 32 bits of object 7000:1, which has 16");
    EXPECT_EQ(reading.messages[0].help,
              "the bits of the PDO are exchanged; if its mapping is rejected, list the objects");
}

}  // namespace
}  // namespace hal::ethercat::config
