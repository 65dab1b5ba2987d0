// SPDX-License-Identifier: MIT
// Small device descriptions for the tests, with a place for one more thing in them.
#pragma once

#include <algorithm>
#include <gtest/gtest.h>
#include <string>

#include "components/canopen/eds/eds.hpp"

namespace hal::canopen::eds::test {

/// A description without a defect: its first line is line 1, what is added begins at `added_line`.
inline std::string motor(const std::string& added = "", const std::string& optional = "",
                         const std::string& manufacturer = "") {
    const auto list = [](const std::string& items) {
        std::string text;
        int count = 0;
        for (std::size_t at = 0; at < items.size();) {
            const std::size_t stop = std::min(items.find(' ', at), items.size());
            text += std::to_string(++count) + "=0x" + items.substr(at, stop - at) + "\n";
            at = stop + 1;
        }
        return "SupportedObjects=" + std::to_string(count) + "\n" + text;
    };
    return "[FileInfo]\nFileName=motor.eds\nFileVersion=1\nFileRevision=2\nEDSVersion=4."
           "0\nDescription=a motor\nCreationTime=10:00AM\n"
           "CreationDate=03-14-2024\nCreatedBy=us\nModificationTime=10:00AM\nModificationDate=03-"
           "14-2024\nModifiedBy=us\n"
           "[DeviceInfo]\nVendorName=Halcyon\nVendorNumber=0x360\nProductName=Motor\nProductNumber="
           "7\nRevisionNumber=0x10002\nOrderCode=M-"
           "1\n"
           "BaudRate_125=1\nBaudRate_1000=1\nSimpleBootUpMaster=0\nSimpleBootUpSlave="
           "1\nGranularity=8\nDynamicChannelsSupported=0\n"
           "GroupMessaging=0\nNrOfRXPDO=0\nNrOfTXPDO=0\nLSS_Supported=1\n"
           "[DummyUsage]\nDummy0005=1\nDummy0007=0\n"
           "[Comments]\nLines=2\nLine1=made for tests\nLine2=and for nothing else\n"
           "[MandatoryObjects]\n" +
           list("1000 1001 1018") + "[OptionalObjects]\n" + list(optional) +
           "[ManufacturerObjects]\n" + list(manufacturer) +
           "[1000]\nParameterName=Device "
           "type\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\nDefaultValue=0x20192\nPDOMapping="
           "0\n"
           "[1001]\nParameterName=Error register\nDataType=0x0005\nAccessType=ro\nPDOMapping=1\n"
           "[1018]\nParameterName=Identity\nObjectType=0x9\nSubNumber=2\n"
           "[1018sub0]\nParameterName=Highest "
           "sub-index\nDataType=0x0005\nAccessType=const\nDefaultValue=1\n"
           "[1018sub1]\nParameterName=Vendor\nDataType=0x0007\nAccessType=ro\nDefaultValue="
           "0x360\n" +
           added;
}

inline std::string variable(const std::string& index, const std::string& type,
                            const std::string& more) {
    return "[" + index + "]\nParameterName=Value\nObjectType=0x7\nDataType=" + type +
           "\nAccessType=rw\nPDOMapping=0\n" + more;
}

/// All messages but notes, a line each; the whole of what is wrong.
inline std::string complaints(const ReadResult& reading, Severity min = Severity::warning) {
    std::string text;
    for (const Message& message : reading.messages) {
        if (message.severity >= min) {
            text += to_string(message) + "\n";
        }
    }
    return text;
}

/// The line (from 1) of the only place where `word` stands.
inline std::string line_of(const std::string& text, const std::string& word) {
    const std::size_t at = text.find(word);
    EXPECT_NE(at, std::string::npos) << word;
    return "line " +
           std::to_string(
               1 + std::count(text.begin(),
                              text.begin() + static_cast<std::ptrdiff_t>(std::min(at, text.size())),
                              '\n')) +
           ",";
}

}  // namespace hal::canopen::eds::test
