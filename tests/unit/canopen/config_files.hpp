// SPDX-License-Identifier: MIT
// The device descriptions that the tests of configurations read.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>

#include "canopen/master/config/bus_schedule.hpp"
#include "canopen/master/config/node_objects.hpp"

namespace hal::canopen::config {
namespace {

constexpr const char* eds_text = R"([DeviceInfo]
VendorName=Maker
VendorNumber=0x1234
ProductNumber=0x10
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[1000]
ParameterName=Device type
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
[1001]
ParameterName=Error register
DataType=0x0005
AccessType=ro
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=const
DefaultValue=1
[1018sub1]
ParameterName=Vendor
DataType=0x0007
AccessType=ro
DefaultValue=0x1234
[OptionalObjects]
SupportedObjects=2
1=0x1800
2=0x1A00
[1800]
ParameterName=TPDO 1
ObjectType=0x9
SubNumber=3
[1800sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=const
DefaultValue=2
[1800sub1]
ParameterName=COB-ID
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x180
[1800sub2]
ParameterName=Transmission type
DataType=0x0005
AccessType=rw
DefaultValue=254
[1A00]
ParameterName=TPDO 1 mapping
ObjectType=0x9
SubNumber=2
[1A00sub0]
ParameterName=Number
DataType=0x0005
AccessType=rw
DefaultValue=1
[1A00sub1]
ParameterName=Entry
DataType=0x0007
AccessType=rw
DefaultValue=0x20000010
[ManufacturerObjects]
SupportedObjects=2
1=0x2000
2=0x2001
[2000]
ParameterName=Motor Temperature
DataType=0x0003
AccessType=ro
PDOMapping=1
[2001]
ParameterName=Fan (speed)
DataType=0x0006
AccessType=rww
PDOMapping=1
)";

/// The same device as a DCF: two values, and two tables in files.
inline std::string dcf_text(const std::string& more = "") {
    std::string text = eds_text;
    const std::string list = "SupportedObjects=2\n1=0x2000\n2=0x2001\n";
    text.replace(
        text.find(list), list.size(),
        "SupportedObjects=6\n1=0x2000\n2=0x2001\n3=0x2002\n4=0x2003\n5=0x2004\n6=0x2005\n");
    text +=
        "[2002]\nParameterName=Ramp\nDataType=0x0006\nAccessType=rw\nDefaultValue="
        "1\nParameterValue=7\n";
    text += "[2003]\nParameterName=Limit\nDataType=0x0006\nAccessType=rw\nParameterValue=7000\n";
    text +=
        "[2004]\nParameterName=Cam\nObjectType=0x2\nDataType=0x000F\nAccessType=rw\nDownloadFile="
        "cam.bin\n";
    text +=
        "[2005]\nParameterName=Gear\nObjectType=0x2\nDataType=0x000F\nAccessType=rw\nDownloadFile="
        "empty.bin\n";
    if (!more.empty()) {
        text +=
            "[2006]\nParameterName=More\nObjectType=0x2\nDataType=0x000F\nAccessType="
            "rw\nDownloadFile=" +
            more + "\n";
    }
    return text + "[DeviceComissioning]\nNodeID=5\nBaudrate=1000\n";
}

inline bool files(const std::string& path, std::string& bytes) {
    if (path == "machine/drive.eds") {
        bytes = eds_text;
        return true;
    }
    if (path == "machine/mpdo.eds") {
        bytes = eds_text;
        const std::string count = "DefaultValue=1\n[1A00sub1]";
        bytes.replace(bytes.find(count), count.size(), "DefaultValue=0xFE\n[1A00sub1]");

        return true;
    }
    if (path == "machine/unit/drive.dcf") {
        bytes = dcf_text();
        return true;
    }
    if (path == "machine/unit/lost.dcf") {
        bytes = dcf_text("lost.bin");
        return true;
    }
    if (path == "machine/unit/program.dcf") {
        const std::string list = "[ManufacturerObjects]";
        bytes = dcf_text();
        bytes.replace(bytes.find("[OptionalObjects]\nSupportedObjects=2\n1=0x1800\n2=0x1A00\n"), 55,
                      "[OptionalObjects]\nSupportedObjects=3\n1=0x1800\n2=0x1A00\n3=0x1F50\n");
        bytes.insert(bytes.find(list),
                     "[1F50]\nParameterName=Program\nObjectType=0x8\nSubNumber=2\n[1F50sub0]"
                     "\nParameterName=n\nDataType=0x0005\n"
                     "AccessType=const\nDefaultValue=1\n[1F50sub1]\nParameterName="
                     "Program\nObjectType=0x2\nDataType=0x000F\n"
                     "AccessType=wo\nDownloadFile=new.bin\n");
        return true;
    }
    if (path == "machine/unit/cam.bin") {
        bytes = std::string("\0\1\2", 3);
        return true;
    }
    if (path == "machine/unit/empty.bin") {
        bytes.clear();
        return true;
    }
    bytes = "No such file or directory";
    return false;
}

inline ReadResult read_text(const std::string& text) {
    return read(text, "machine/arm.canopen", files);
}
inline MasterConfig good(const std::string& text) {
    ReadResult r = read_text(text);
    EXPECT_EQ(to_string(r, "arm"), "");
    return r.config;
}
inline std::string said(const std::string& text) { return to_string(read_text(text), "arm"); }
inline const Pdo* find(const Node& n, bool to_node, unsigned number) {
    for (const Pdo& p : n.pdos) {
        if (p.to_node == to_node && p.number == number) return &p;
    }
    return nullptr;
}

}  // namespace
}  // namespace hal::canopen::config
