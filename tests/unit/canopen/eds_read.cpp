// SPDX-License-Identifier: MIT
// What is read from a device description, and each of the usual defects: named with its line, and
// survived.
#include "eds_text.hpp"

namespace hal::canopen::eds::test {
namespace {

TEST(EdsRead, A_correct_file_has_no_messages) {
    const ReadResult reading = read_eds(motor());
    ASSERT_TRUE(reading.description);
    EXPECT_EQ(complaints(reading, Severity::note), "");
    const DeviceDescription& d = *reading.description;
    EXPECT_EQ(d.file.description, "a motor");
    EXPECT_EQ(d.file.revision, 2);
    EXPECT_EQ(d.device.vendor_number, 0x360u);
    EXPECT_EQ(d.device.revision_number, 0x10002u);
    EXPECT_TRUE(d.device.supports[4]);
    EXPECT_FALSE(d.device.supports[0]);
    EXPECT_TRUE(d.device.lss);
    EXPECT_EQ(d.dummies, (std::vector<std::pair<std::uint16_t, bool>>{{5, true}, {7, false}}));
    EXPECT_EQ(d.comments, (std::vector<std::string>{"made for tests", "and for nothing else"}));
    ASSERT_EQ(d.objects.size(), 3u);
    EXPECT_EQ(d.find(0x1000)->category, Category::mandatory);
    EXPECT_EQ(d.find(0x1018, 1)->default_value, "0x360");
    EXPECT_TRUE(d.find(0x1001, 0)->pdo_mapping);
    EXPECT_EQ(d.find(0x1018, 0)->access, Access::constant);
    EXPECT_FALSE(d.commissioning);
}

TEST(EdsRead, A_commissioning_makes_it_a_dcf) {
    for (const char* name : {"DeviceComissioning", "DeviceCommissioning"}) {
        const ReadResult reading = read_eds(motor(
            "[" + std::string(name) +
            "]\nNodeID=0x05\nNodeName=left\nBaudrate=1000\nNetNumber=2\nLSS_SerialNumber=0x77\n"));
        ASSERT_TRUE(reading.description && reading.description->commissioning);
        EXPECT_EQ(complaints(reading), "");
        EXPECT_EQ(reading.description->node_id(), 5u);
        EXPECT_EQ(reading.description->commissioning->baud_rate, 1000);
        EXPECT_EQ(reading.description->commissioning->lss_serial_number, 0x77u);
    }
    EXPECT_NE(complaints(read_eds(motor("[DeviceComissioning]\nNodeID=200\nBaudrate=333\n")))
                  .find("invalid node ID '200'"),
              std::string::npos);
}

struct Defect {
    const char* name;
    std::string added, optional, manufacturer;  ///< what is put into the file
    std::string at, message;  ///< the text of the line, and the message about it
};
class EdsDefect : public testing::TestWithParam<Defect> {};

TEST_P(EdsDefect, Is_named_with_its_line_and_survived) {
    const Defect& defect = GetParam();
    const std::string text = motor(defect.added, defect.optional, defect.manufacturer);
    const ReadResult reading = read_eds(text);
    ASSERT_TRUE(reading.description);
    const std::string all = complaints(reading, Severity::note);
    const std::string wanted = line_of(text, defect.at);
    EXPECT_NE(all.find(defect.message), std::string::npos) << all;
    bool there = false;
    for (std::size_t at = 0; at < all.size();) {
        const std::size_t stop = all.find('\n', at);
        const std::string line = all.substr(at, stop - at);
        there =
            there || (line.rfind(wanted, 0) == 0 && line.find(defect.message) != std::string::npos);
        at = stop + 1;
    }
    EXPECT_TRUE(there) << "not at " << wanted << "\n" << all;
    EXPECT_EQ(*read_eds(write_eds(*reading.description)).description, *reading.description);
}

INSTANTIATE_TEST_SUITE_P(
    All, EdsDefect,
    testing::Values(
        Defect{"section_twice", "[1001]\nDataType=0x0006\n", "", "", "[1001]\nDataType=0x0006",
               "duplicate section [1001]"},
        Defect{"key_twice", variable("2000", "0x7", "DefaultValue=1\nDefaultValue=2\n"), "", "2000",
               "DefaultValue=2", "duplicate key 'DefaultValue'"},
        Defect{"no_equal_sign", "[2000]\nbroken line\nParameterName=x\nDataType=5\nAccessType=ro\n",
               "", "2000", "broken line", "invalid line: neither a [section] nor Key=Value"},
        Defect{"unclosed_section", "[2000\nParameterName=x\nDataType=5\nAccessType=ro\n", "",
               "2000", "[2000", "section name without ']'"},
        Defect{"misspelt_section", "[2000 sub 1]\nParameterName=x\nDataType=5\nAccessType=ro\n", "",
               "2000", "[2000 sub 1]", "write [2000sub1]"},
        Defect{"inline_comment", variable("2000", "0x0007 # UNSIGNED32", ""), "", "2000",
               "0x0007 # UNSIGNED32", "comment after the value of 'DataType' ignored"},
        Defect{"name_missing", "[2000]\nDataType=5\nAccessType=ro\n", "", "2000", "[2000]",
               "'ParameterName' of 2000 is missing"},
        Defect{"type_missing", "[2000]\nParameterName=x\nAccessType=ro\n", "", "2000", "[2000]",
               "'DataType' of 2000 is missing"},
        Defect{"type_empty", variable("2000", "", ""), "", "2000", "DataType=\n",
               "'DataType' of 2000 is empty"},
        Defect{"type_word", variable("2000", "UNSIGNED16", ""), "", "2000", "DataType=UNSIGNED16",
               "write 0x0006"},
        Defect{"type_unknown", variable("2000", "0x0E", ""), "", "2000", "DataType=0x0E",
               "unknown data type 0x000E"},
        Defect{"access_missing", "[2000]\nParameterName=x\nDataType=5\n", "", "2000", "[2000]",
               "'AccessType' of 2000 is missing"},
        Defect{"access_misspelt", "[2000]\nParameterName=x\nDataType=5\nAccessType=readonly\n", "",
               "2000", "readonly", "read as ro"},
        Defect{"object_type_empty",
               "[2000]\nParameterName=x\nObjectType=\nDataType=5\nAccessType=ro\n", "", "2000",
               "ObjectType=\n", "'ObjectType' of 2000 is empty"},
        Defect{"key_misspelt", "[2000]\nParameterName=x\nDataType=5\nAcessType=ro\n", "", "2000",
               "AcessType", "did you mean 'AccessType'?"},
        Defect{"default_too_large", variable("2000", "0x5", "DefaultValue=300\n"), "", "2000",
               "DefaultValue=300", "'300' does not fit into UNSIGNED8 (0..255)"},
        Defect{"default_no_number", variable("2000", "0x5", "DefaultValue=FF\n"), "", "2000",
               "DefaultValue=FF", "write 0xFF"},
        Defect{"default_octal", variable("2000", "0x6", "DefaultValue=010\n"), "", "2000",
               "DefaultValue=010", "is read as octal: 0x0008"},
        Defect{"default_almost_octal", variable("2000", "0x6", "DefaultValue=019\n"), "", "2000",
               "DefaultValue=019", "but is not octal"},
        Defect{"negative_as_bits", variable("2000", "0x2", "DefaultValue=0xFF\n"), "", "2000",
               "DefaultValue=0xFF", "the bit pattern of a negative number: -1"},
        Defect{"natural_negative", variable("2000", "0x7", "DefaultValue=-1\n"), "", "2000",
               "DefaultValue=-1", "is negative, but its type is UNSIGNED32"},
        Defect{"real_as_bits", variable("2000", "0x8", "DefaultValue=0x3FC00000\n"), "", "2000",
               "0x3FC00000", "is read as the bit pattern of 1.5"},
        Defect{"integer_as_real", variable("2000", "0x5", "DefaultValue=12.0\n"), "", "2000",
               "DefaultValue=12.0", "is written as a fraction"},
        Defect{"outside_limits",
               variable("2000", "0x3", "LowLimit=-5\nHighLimit=5\nDefaultValue=6\n"), "", "2000",
               "DefaultValue=6", "is out of range: 6"},
        Defect{"outside_limits_of_64_bits",
               variable("2000", "0x1B",
                        "HighLimit=0xFFFFFFFFFFFFFFFE\nDefaultValue=0xFFFFFFFFFFFFFFFF\n"),
               "", "2000", "DefaultValue=0xFFFFFFFFFFFFFFFF",
               "is out of range: 0xFFFFFFFFFFFFFFFF"},
        Defect{"limits_exchanged", variable("2000", "0x3", "LowLimit=5\nHighLimit=-5\n"), "",
               "2000", "LowLimit=5", "empty range of 2000: 5..-5"},
        Defect{"mapping_word",
               "[2000]\nParameterName=x\nDataType=5\nAccessType=ro\nPDOMapping=yes\n", "", "2000",
               "PDOMapping=yes", "'PDOMapping' is 0 or 1"},
        Defect{"listed_only", "", "", "2000", "1=0x2000",
               "object 2000 is listed but not described"},
        Defect{"listed_twice", variable("2000", "5", ""), "", "2000 2000", "2=0x2000",
               "object 2000 is listed twice"},
        Defect{"not_listed", variable("2000", "5", ""), "", "", "[2000]",
               "object 2000 is described but not listed"},
        Defect{"sub_without_object", "[2000sub0]\nParameterName=x\nDataType=5\nAccessType=ro\n", "",
               "2000", "[2000sub0]", "missing section [2000]"},
        Defect{"sub_0_missing",
               "[2000]\nParameterName=x\nObjectType=8\nSubNumber=1\n[2000sub1]\nParameterName="
               "y\nDataType=5\nAccessType=ro\n",
               "", "2000", "[2000]\n", "missing sub-index 0 of 2000"},
        Defect{"sub_number_wrong",
               "[2000]\nParameterName=x\nObjectType=9\nSubNumber=8\n[2000sub0]\nParameterName="
               "y\nDataType=5\nAccessType=ro\n",
               "", "2000", "SubNumber=8", "is 8, the file describes 1"},
        Defect{"sub_too_high", "[2000sub100]\nParameterName=y\nDataType=5\nAccessType=ro\n", "", "",
               "[2000sub100]", "invalid sub-index 0x100"},
        Defect{"variable_with_subs",
               "[2000]\nParameterName=x\nObjectType=7\n[2000sub0]\nParameterName=y\nDataType="
               "5\nAccessType=ro\n",
               "", "2000", "ObjectType=7", "but the file describes sub-indices"},
        Defect{"no_entries", "[2000]\nParameterName=x\nObjectType=9\n", "", "2000", "[2000]",
               "has no sub-indices"},
        Defect{"maps_nothing",
               "[1A00]\nParameterName=m\nObjectType=9\nSubNumber=2\n[1A00sub0]\nParameterName="
               "n\nDataType=5\nAccessType=rw\nDefaultValue=1\n"
               "[1A00sub1]\nParameterName=o\nDataType=7\nAccessType=rw\nDefaultValue=0x60000008\n",
               "1A00", "", "[1A00sub1]", "1A00sub1 maps 6000, which is not described"},
        Defect{"maps_other_length",
               "[1A00]\nParameterName=m\nObjectType=9\nSubNumber=2\n[1A00sub0]\nParameterName="
               "n\nDataType=5\nAccessType=rw\nDefaultValue=1\n"
               "[1A00sub1]\nParameterName=o\nDataType=7\nAccessType=rw\nDefaultValue=0x10010010\n",
               "1A00", "", "[1A00sub1]", "with 16 bits; it has 8"}),
    [](const auto& defect) { return std::string(defect.param.name); });

TEST(EdsRead, Counts_that_do_not_agree_are_named) {
    std::string text = motor();
    text.replace(text.find("Lines=2"), 7, "Lines=5");
    text.replace(text.find("SupportedObjects=3"), 18, "SupportedObjects=4");
    const ReadResult reading = read_eds(text);
    const std::string all = complaints(reading, Severity::note);
    EXPECT_NE(all.find("'Lines' of [Comments] is 5, there are 2"), std::string::npos) << all;
    EXPECT_NE(all.find("'SupportedObjects' of [MandatoryObjects] is 4, the section lists 3"),
              std::string::npos)
        << all;
    EXPECT_EQ(reading.description->comments.size(), 2u);
}

TEST(EdsRead, Texts_of_every_encoding_are_read) {
    const std::string plain = motor(variable("2000", "0x9", "DefaultValue=25 °C\n"), "", "2000");
    std::string wide = "\xFF\xFE", windows, dos = "\xEF\xBB\xBF", old;
    for (std::size_t i = 0; i < plain.size(); ++i) {
        if (plain[i] == '\xC2') {
            continue;  // the sign of degrees is U+00B0
        }
        wide += plain[i];
        wide += '\0';
        windows += plain[i];
    }
    for (const char c : plain) {
        dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
        old += c == '\n' ? '\r' : c;
    }
    const DeviceDescription wanted = *read_eds(plain).description;
    EXPECT_EQ(wanted.find(0x2000, 0)->default_value, "25 °C");
    for (const std::string& text : {wide, windows, dos, old}) {
        const ReadResult reading = read_eds(text);
        ASSERT_TRUE(reading.description);
        EXPECT_EQ(*reading.description, wanted);
    }
    EXPECT_NE(complaints(read_eds(wide)).find("UTF-16"), std::string::npos);
    EXPECT_NE(complaints(read_eds(windows), Severity::note).find("Windows-1252"),
              std::string::npos);
}

TEST(EdsRead, What_is_no_description_is_refused_with_the_reason) {
    struct {
        std::string text, why;
    } cases[] = {{"", "the file is empty"},
                 {" \r\n\t", "the file is empty"},
                 {"hello", "describes neither a device nor an object"},
                 {"[Section]\nkey=1\n", "describes neither a device nor an object"},
                 {std::string(1000, '\0'), "not a text file"},
                 {"<?xml version=\"1.0\"?>", "XML"},
                 {std::string("\x7f"
                              "ELF") +
                      std::string(500, '\0'),
                  "not a text file"}};
    for (const auto& one : cases) {
        const ReadResult reading = read_eds(one.text);
        EXPECT_FALSE(reading.description);
        ASSERT_FALSE(reading.messages.empty());
        EXPECT_NE(to_string(reading.messages.back()).find(one.why), std::string::npos)
            << to_string(reading.messages.back());
        EXPECT_EQ(reading.messages.back().severity, Severity::error);
    }
}

TEST(EdsRead, Compact_objects_are_expanded) {
    const ReadResult reading =
        read_eds(motor("[2000]\nParameterName=Speed\nObjectType=0x8\nDataType=0x0004\nAccessType="
                       "rw\nDefaultValue=7\nPDOMapping=1\nCompactSubObj=3\n"
                       "[2000Name]\nNrOfEntries=1\n2=Middle\n[2000Value]\nNrOfEntries=1\n3=-9\n["
                       "2000Denotation]\nNrOfEntries=1\n1=first\n",
                       "", "2000"));
    EXPECT_EQ(complaints(reading), "");
    const Object& object = *reading.description->find(0x2000);
    ASSERT_EQ(object.entries.size(), 4u);
    EXPECT_EQ(object.entries[0].default_value, "3");
    EXPECT_EQ(object.entries[1].name, "Speed1");
    EXPECT_EQ(object.entries[1].denotation, "first");
    EXPECT_EQ(object.entries[2].name, "Middle");
    EXPECT_EQ(object.entries[3].parameter_value, "-9");
    EXPECT_EQ(object.entries[3].default_value, "7");
    EXPECT_TRUE(object.entries[3].pdo_mapping);
}

TEST(EdsRead, Modules_are_joined_to_the_device) {
    const std::string text = motor(
        "[SupportedModules]\nNrOfEntries=2\n[M1ModuleInfo]\nProductName=Inputs\nProductVersion="
        "1\nProductRevision=0\nOrderCode=I8\n["
        "M1Comments]\nLines=1\nLine1=eight inputs\n"
        "[M1SubExtends]\nNrOfEntries=1\n1=0x6000\n[M1SubExt6000]\nParameterName=Inputs\nDataType="
        "5\nAccessType=ro\nPDOMapping=1\nCount="
        "2\nObjExtend=0\n"
        "[M2ModuleInfo]\nProductName=Thing\nProductVersion=1\nProductRevision=0\nOrderCode=T\n["
        "M2FixedObjects]\nNrOfEntries=1\n1=0x2100\n"
        "[M22100]\nParameterName=Own\nDataType=6\nAccessType=rw\nDefaultValue=3\n"
        "[ConnectedModules]\nNrOfEntries=3\n1=1\n2=2\n3=1\n");
    const ReadResult reading = read_eds(text);
    ASSERT_TRUE(reading.description);
    EXPECT_EQ(complaints(reading), "");
    DeviceDescription d = *reading.description;
    ASSERT_EQ(d.modules.size(), 2u);
    EXPECT_EQ(d.modules[0].comments, std::vector<std::string>{"eight inputs"});
    EXPECT_EQ(d.connected_modules, (std::vector<unsigned>{1, 2, 1}));
    EXPECT_EQ(*read_eds(write_eds(d)).description, d);
    std::vector<Message> messages;
    connect_modules(d, messages);
    EXPECT_TRUE(messages.empty());
    ASSERT_NE(d.find(0x6000), nullptr);
    EXPECT_EQ(d.find(0x6000)->entries.size(), 5u);
    EXPECT_EQ(d.find(0x6000, 0)->default_value, "4");
    EXPECT_EQ(d.find(0x2100, 0)->default_value, "3");
}

TEST(EdsRead, Compact_pdos_are_made) {
    std::string text = motor();
    text.replace(text.find("NrOfRXPDO=0"), 11, "NrOfRXPDO=2\nCompactPDO=0x13");
    const ReadResult reading = read_eds(text);
    const DeviceDescription& d = *reading.description;
    ASSERT_NE(d.find(0x1401), nullptr);
    EXPECT_EQ(d.find(0x1401, 1)->default_value, "$NODEID+0x300");
    EXPECT_EQ(d.find(0x1401, 0)->default_value, "5");
    EXPECT_EQ(d.find(0x1401, 3), nullptr);
    EXPECT_NE(d.find(0x1601, 64), nullptr);
    EXPECT_EQ(*read_eds(write_eds(d)).description, d);
}

TEST(EdsRead, What_is_not_known_is_kept) {
    const std::string text =
        "; a first line\n" + motor(
                                 "[2000]\n;StorageLocation=RAM\nParameterName=x\nDataType="
                                 "5\nAccessType=ro\nUnit=mm\n[Tools]\nItems=1\n",
                                 "", "2000");
    const DeviceDescription d = *read_eds(text).description;
    EXPECT_EQ(d.preamble, std::vector<std::string>{"; a first line"});
    EXPECT_EQ(d.find(0x2000)->extras, (Extras{{"", ";StorageLocation=RAM"}, {"Unit", "mm"}}));
    ASSERT_EQ(d.others.size(), 1u);
    EXPECT_EQ(d.others[0].name, "Tools");
    const std::string written = write_eds(d);
    for (const char* word : {"; a first line", ";StorageLocation=RAM", "Unit=mm", "Items=1"}) {
        EXPECT_NE(written.find(word), std::string::npos) << word;
    }
    EXPECT_EQ(*read_eds(written).description, d);
}

TEST(EdsRead, Values_of_every_type_become_bytes) {
    using Bytes = std::vector<std::uint8_t>;
    const auto bytes = [](std::string_view text, std::uint16_t type) {
        return encode(text, type, 5).bytes;
    };
    EXPECT_EQ(bytes("1", 0x01), Bytes{1});
    EXPECT_EQ(bytes("-2", 0x03), (Bytes{0xFE, 0xFF}));
    EXPECT_EQ(bytes("0xFFFE", 0x03), (Bytes{0xFE, 0xFF}));
    EXPECT_EQ(bytes("-8388608", 0x10), (Bytes{0, 0, 0x80}));
    EXPECT_EQ(bytes("18446744073709551615", 0x1B), Bytes(8, 0xFF));
    EXPECT_EQ(bytes("-9223372036854775808", 0x15), (Bytes{0, 0, 0, 0, 0, 0, 0, 0x80}));
    EXPECT_EQ(bytes("1.5", 0x08), (Bytes{0, 0, 0xC0, 0x3F}));
    EXPECT_EQ(bytes("-2", 0x11), (Bytes{0, 0, 0, 0, 0, 0, 0, 0xC0}));
    EXPECT_EQ(bytes("hi", 0x09), (Bytes{'h', 'i'}));
    EXPECT_EQ(bytes("01 aB", 0x0A), (Bytes{1, 0xAB}));
    EXPECT_EQ(bytes("é", 0x0B), (Bytes{0xE9, 0}));
    EXPECT_EQ(bytes("365 43200000", 0x0C), (Bytes{0x00, 0x2E, 0x93, 0x02, 0x6D, 0x01}));
    for (const char* formula :
         {"$NODEID+0x180", "0x180+$NODEID", "$NodeID + 0x180", "384+$nodeid"}) {
        EXPECT_EQ(bytes(formula, 0x07), (Bytes{0x85, 1, 0, 0})) << formula;
    }
    EXPECT_TRUE(encode("$NODEID+0x180", 0x07, 5).node_id);
    for (const char* bad : {"", "+", "1+", "0x", "$NODE", "1 2", "$NODEID+$NODEID", "--1", "1e5x",
                            "99999999999999999999"}) {
        EXPECT_FALSE(parse_number(bad)) << bad;
    }
    EXPECT_FALSE(encode("65536", 0x06, 0));
    EXPECT_FALSE(encode("-129", 0x02, 0));
    EXPECT_FALSE(encode("0xABC", 0x0A, 0));
    EXPECT_FALSE(encode("1e39", 0x08, 0));
}

TEST(EdsRead, Spelling_and_encoding_are_each_others_opposite) {
    for (const DataType& type : data_types()) {
        if (type.kind == Kind::structure || type.kind == Kind::unicode) continue;
        for (const unsigned seed : {0u, 1u, 0x7Fu, 0x40u}) {
            std::vector<std::uint8_t> bytes(
                type.bits == 0 ? 5 : type.bytes(),
                static_cast<std::uint8_t>(type.kind == Kind::boolean ? seed & 1
                                          : type.kind == Kind::text  ? 'a'
                                                                     : seed));
            EXPECT_EQ(encode(spell(bytes, type.code), type.code, 0).bytes, bytes)
                << type.name << " " << seed << " " << spell(bytes, type.code);
        }
    }
}

}  // namespace
}  // namespace hal::canopen::eds::test
