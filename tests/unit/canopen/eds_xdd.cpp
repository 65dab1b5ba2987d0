// SPDX-License-Identifier: MIT
// Device descriptions in XML, read into the same structures.
#include "components/canopen/eds/xdd.hpp"
#include "eds_text.hpp"

namespace hal::canopen::eds::test {
namespace {

std::string xdd(const std::string& objects, const std::string& more = "") {
    return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<ISO15745ProfileContainer "
           "xmlns=\"http://www.canopen.org/xml/1.0\">\n<ISO15745Profile>\n"
           "<ProfileBody fileName=\"motor.xdd\" fileCreator=\"us\" fileCreationDate=\"2024-03-14\" "
           "fileVersion=\"2\">\n"
           "<DeviceIdentity><vendorName>Halcyon</vendorName><vendorID>0x360</"
           "vendorID><productName>Motor</productName><productID>0x7</"
           "productID></DeviceIdentity>\n"
           "<ApplicationProcess><parameterList><parameter uniqueID=\"P1\" "
           "access=\"readWrite\"><label lang=\"en\">Target "
           "speed</label><INT/>"
           "<defaultValue value=\"-3\"/><allowedValues><range><minValue value=\"-10\"/><maxValue "
           "value=\"10\"/></range></allowedValues></parameter></parameterList></"
           "ApplicationProcess>\n"
           "</ProfileBody></"
           "ISO15745Profile>\n<ISO15745Profile><ProfileBody>\n<ApplicationLayers><"
           "CANopenObjectList>\n"
           "<CANopenObject index=\"1000\" name=\"Device type\" objectType=\"7\" dataType=\"0007\" "
           "accessType=\"const\" "
           "defaultValue=\"0x20192\" PDOmapping=\"no\"/>\n" +
           objects +
           "</CANopenObjectList><dummyUsage><dummy "
           "entry=\"Dummy0005=1\"/></dummyUsage></ApplicationLayers>\n"
           "<TransportLayers><PhysicalLayer><baudRate><supportedBaudRate value=\"125 "
           "Kbps\"/><supportedBaudRate value=\"1000 "
           "Kbps\"/></baudRate></PhysicalLayer></TransportLayers>\n"
           "<NetworkManagement><CANopenGeneralFeatures granularity=\"8\" nrOfRxPDO=\"0\" "
           "nrOfTxPDO=\"0\" bootUpSlave=\"true\" "
           "layerSettingServiceSlave=\"true\"/>" +
           more +
           "</NetworkManagement>\n</ProfileBody></ISO15745Profile>\n</ISO15745ProfileContainer>\n";
}

class Xdd : public testing::Test {
protected:
    void SetUp() override {
        if (complaints(read_xdd("<a/>"), Severity::error).find("not read by this build") !=
            std::string::npos) {
            GTEST_SKIP() << "built without pugixml";
        }
    }
};

TEST_F(Xdd, Is_read_into_the_same_structures_as_an_eds) {
    const ReadResult reading = read_description(
        xdd("<CANopenObject index=\"2000\" objectType=\"7\" uniqueIDRef=\"P1\" "
            "PDOmapping=\"optional\"/>\n"
            "<CANopenObject index=\"1018\" name=\"Identity\" objectType=\"9\" subNumber=\"2\">"
            "<CANopenSubObject subIndex=\"00\" name=\"n\" objectType=\"7\" dataType=\"0005\" "
            "accessType=\"ro\" defaultValue=\"1\"/>"
            "<CANopenSubObject subIndex=\"01\" name=\"Vendor\" objectType=\"7\" dataType=\"0007\" "
            "accessType=\"ro\" "
            "defaultValue=\"0x360\"/></CANopenObject>\n"));
    ASSERT_TRUE(reading.description) << complaints(reading);
    EXPECT_EQ(complaints(reading, Severity::note), "");
    const DeviceDescription& d = *reading.description;
    EXPECT_EQ(d.device.vendor_number, 0x360u);
    EXPECT_EQ(d.device.product_name, "Motor");
    EXPECT_EQ(d.file.creation_date, "03-14-2024");
    EXPECT_TRUE(d.device.supports[4] && d.device.supports[8] && d.device.lss &&
                d.device.boot_up_slave);
    EXPECT_EQ(d.dummies.size(), 1u);
    ASSERT_EQ(d.objects.size(), 3u);
    EXPECT_EQ(d.find(0x1018, 1)->default_value, "0x360");
    const Entry& speed = *d.find(0x2000, 0);
    EXPECT_EQ(speed.name, "Target speed");
    EXPECT_EQ(speed.data_type, 0x03);
    EXPECT_EQ(speed.access, Access::rw);
    EXPECT_EQ(speed.default_value, "-3");
    EXPECT_EQ(speed.high_limit, "10");
    EXPECT_TRUE(speed.pdo_mapping);
    EXPECT_EQ(*read_eds(write_eds(d)).description, d);  // becomes an EDS
}

TEST_F(Xdd, A_parameter_without_access_can_be_read_as_the_schema_says) {
    std::string text = xdd(
        "<CANopenObject index=\"2000\" objectType=\"7\" uniqueIDRef=\"P1\"/>\n"
        "<CANopenObject index=\"2001\" objectType=\"7\" uniqueIDRef=\"P1\" accessType=\"wo\"/>\n");
    text.replace(text.find(" access=\"readWrite\""), std::string(" access=\"readWrite\"").size(),
                 "");
    const ReadResult reading = read_xdd(text);
    ASSERT_TRUE(reading.description) << complaints(reading);
    EXPECT_EQ(complaints(reading, Severity::note), "");
    EXPECT_EQ(reading.description->find(0x2000, 0)->access, Access::ro);
    EXPECT_EQ(reading.description->find(0x2001, 0)->access, Access::wo);
}

TEST_F(Xdd, A_configuration_has_node_id_and_values) {
    const ReadResult reading =
        read_xdd(xdd("<CANopenObject index=\"2000\" name=\"x\" objectType=\"7\" dataType=\"0006\" "
                     "accessType=\"rw\" defaultValue=\"1\" "
                     "actualValue=\"2\"/>\n",
                     "<deviceCommissioning nodeID=\"5\" nodeName=\"left\" actualBaudRate=\"500 "
                     "Kbps\" networkNumber=\"1\" "
                     "networkName=\"n\" CANopenManager=\"false\"/>"));
    ASSERT_TRUE(reading.description && reading.description->commissioning);
    EXPECT_EQ(reading.description->node_id(), 5u);
    EXPECT_EQ(reading.description->commissioning->baud_rate, 500);
    EXPECT_EQ(reading.description->find(0x2000, 0)->parameter_value, "2");
}

TEST_F(Xdd, Defects_are_named_with_their_line) {
    const std::string text =
        xdd("<CANopenObject index=\"2000\" name=\"x\" objectType=\"7\" dataType=\"0005\" "
            "accessType=\"rw\" defaultValue=\"300\"/>\n"
            "<CANopenObject index=\"2001\" name=\"y\" objectType=\"7\" dataType=\"0005\" "
            "accessType=\"readable\"/>\n"
            "<CANopenObject index=\"2001\" name=\"z\" objectType=\"7\" dataType=\"0005\" "
            "accessType=\"rw\"/>\n<CANopenObject name=\"q\"/>\n"
            "<CANopenObject index=\"2002\" name=\"r\" objectType=\"7\" uniqueIDRef=\"P9\" "
            "dataType=\"0005\" accessType=\"rw\"/>\n");
    const ReadResult reading = read_xdd(text);
    const std::string all = complaints(reading);
    for (const auto& [at, message] :
         {std::pair{"index=\"2000\"", "'300' does not fit into UNSIGNED8"},
          {"readable", "unknown access type 'readable'"},
          {"name=\"z\"", "object 2001 is described twice"},
          {"name=\"q\"", "without an index"},
          {"P9", "parameter 'P9', which is not described"}}) {
        const std::size_t found = all.find(message);
        ASSERT_NE(found, std::string::npos) << message << "\n" << all;
        const std::size_t start = all.rfind('\n', found) + 1;
        EXPECT_EQ(all.substr(start, line_of(text, at).size()), line_of(text, at)) << all;
    }
}

/// Messages of severity note and above, without their places, keys in the spelling of the EDS.
std::string without_places(const ReadResult& reading) {
    std::string all;
    for (const Message& message : reading.messages) {
        std::string text = message.sentence + "; " + message.help + "\n";
        for (const auto& [xml, ini] : {std::pair{"'defaultValue'", "'DefaultValue'"},
                                       {"'actualValue'", "'ParameterValue'"},
                                       {"'lowLimit'", "'LowLimit'"},
                                       {"'highLimit'", "'HighLimit'"}}) {
            if (const std::size_t at = text.find(xml); at != std::string::npos) {
                text.replace(at, std::string_view(xml).size(), ini);
            }
        }
        if (text.find("' of 2000") != std::string::npos) {
            all += text;
        }
    }
    return all;
}

// A number that is read in another way than written, or not at all, gets the same message in an EDS
// or DCF as in an XDD or XDC, for each of the four values of an object.
TEST_F(Xdd, A_doubtful_number_gets_the_message_of_an_eds) {
    const std::pair<const char*, const char*> keys[] = {{"DefaultValue", "defaultValue"},
                                                        {"ParameterValue", "actualValue"},
                                                        {"LowLimit", "lowLimit"},
                                                        {"HighLimit", "highLimit"}};
    std::size_t warned = 0;
    for (const char* type : {"0002", "0005", "0006", "0007", "0008", "0001", "0009"}) {
        for (const char* text : {"-1", "0377", "010", "09", "1.0", "1A", "70000", "true", "0xFF",
                                 "-300", "0x3F800000", "5", "abc"}) {
            for (const auto& [ini, xml] : keys) {
                const ReadResult eds = read_eds(
                    std::string("[OptionalObjects]\nSupportedObjects=1\n1=0x2000\n[2000]\n"
                                "ParameterName=x\nObjectType=7\nAccessType=rw\nDataType=0x") +
                    type + "\n" + ini + "=" + text + "\n");
                const ReadResult xdd_reading = read_xdd(
                    xdd(std::string("<CANopenObject index=\"2000\" name=\"x\" objectType=\"7\" "
                                    "accessType=\"rw\" dataType=\"") +
                        type + "\" " + xml + "=\"" + text + "\"/>\n"));
                EXPECT_EQ(without_places(eds), without_places(xdd_reading)) << type << " " << text;
                warned += !without_places(xdd_reading).empty();
            }
        }
    }
    EXPECT_GT(warned, 100u);
    const ReadResult read =
        read_xdd(xdd("<CANopenObject index=\"2000\" name=\"x\" objectType=\"7\" dataType=\"0005\" "
                     "accessType=\"rw\" actualValue=\"-1\" defaultValue=\"0377\"/>\n"));
    EXPECT_EQ(
        without_places(read),
        "'DefaultValue' of 2000 begins with 0 and is read as octal: 0xFF; remove the 0 if it "
        "is decimal, write 0x if it is hexadecimal\n"
        "'ParameterValue' of 2000 is negative, but its type is UNSIGNED8; read as 0xFF; write "
        "0xFF\n");
}

TEST_F(Xdd, A_number_of_the_device_with_a_leading_zero_or_a_sign_is_named) {
    std::string text =
        xdd("", "<deviceCommissioning nodeID=\"011\" nodeName=\"left\" networkNumber=\"08\"/>");
    text.replace(text.find("0x360</"), 5, "-1");
    const std::string all = complaints(read_xdd(text));
    EXPECT_NE(all.find("'nodeID' begins with 0 and is read as octal: 9"), std::string::npos) << all;
    EXPECT_NE(all.find("'networkNumber' begins with 0 but is not octal"), std::string::npos) << all;
    EXPECT_NE(all.find("'vendorID' is not a 32-bit number: '-1'"), std::string::npos) << all;
}

TEST_F(Xdd, Broken_xml_and_other_xml_are_refused_with_the_reason) {
    const ReadResult broken = read_description(xdd("<CANopenObject index=\"2000\">\n"));
    EXPECT_FALSE(broken.description);
    EXPECT_NE(complaints(broken, Severity::error).find("the XML is broken"), std::string::npos);
    const ReadResult other = read_description("<?xml version=\"1.0\"?>\n<html><body/></html>\n");
    EXPECT_FALSE(other.description);
    EXPECT_NE(complaints(other, Severity::error).find("no CANopenObjectList"), std::string::npos);
}

}  // namespace
}  // namespace hal::canopen::eds::test
