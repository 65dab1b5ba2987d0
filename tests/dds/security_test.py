#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""DDS Security: two machines with certificates of one authority exchange a topic; one without certificates, one with those of another authority, and
one without permission for the topic do not. The certificates are made here, by openssl."""
import shutil
import subprocess
import sys
import unittest

from rig import DOMAIN, DdsCase, wait_until

if not shutil.which("openssl"):
    print("openssl is not installed")
    sys.exit(77)

GOVERNANCE = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"><domain_access_rules><domain_rule>
<domains><id_range><min>0</min><max>230</max></id_range></domains>
<allow_unauthenticated_participants>false</allow_unauthenticated_participants>
<enable_join_access_control>true</enable_join_access_control>
<discovery_protection_kind>ENCRYPT</discovery_protection_kind>
<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
<rtps_protection_kind>SIGN</rtps_protection_kind>
<topic_access_rules><topic_rule><topic_expression>*</topic_expression>
<enable_discovery_protection>true</enable_discovery_protection><enable_liveliness_protection>true</enable_liveliness_protection>
<enable_read_access_control>true</enable_read_access_control><enable_write_access_control>true</enable_write_access_control>
<metadata_protection_kind>ENCRYPT</metadata_protection_kind><data_protection_kind>ENCRYPT</data_protection_kind>
</topic_rule></topic_access_rules></domain_rule></domain_access_rules></dds>
"""
PERMISSIONS = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"><permissions><grant name="{name}">
<subject_name>CN={name},O=Halcyon</subject_name>
<validity><not_before>2020-01-01T00:00:00</not_before><not_after>2099-01-01T00:00:00</not_after></validity>
<allow_rule><domains><id_range><min>0</min><max>230</max></id_range></domains>
<publish><topics><topic>{topic}</topic></topics></publish><subscribe><topics><topic>{topic}</topic></topics></subscribe></allow_rule>
<default>DENY</default></grant></permissions></dds>
"""


class Security(DdsCase):
    def openssl(self, *words):
        done = subprocess.run(
            ["openssl", *map(str, words)], cwd=self.folder, capture_output=True, text=True
        )
        self.assertEqual(0, done.returncode, done.stderr)

    def authority(self, name):
        self.openssl("ecparam", "-name", "prime256v1", "-genkey", "-noout", "-out", f"{name}.key")
        self.openssl(
            "req",
            "-x509",
            "-new",
            "-key",
            f"{name}.key",
            "-days",
            3650,
            "-subj",
            f"/O=Halcyon/CN={name}",
            "-out",
            f"{name}.pem",
        )

    def sign(self, authority, text, to):
        self.write("plain.xml", text)
        self.openssl(
            "smime",
            "-sign",
            "-in",
            "plain.xml",
            "-text",
            "-out",
            to,
            "-signer",
            f"{authority}.pem",
            "-inkey",
            f"{authority}.key",
        )

    def enclave(self, name, authority="authority", topic="arm/state"):
        """Creates the folder of one machine, in the layout of a ROS 2 enclave."""
        (self.folder / name).mkdir()
        self.openssl(
            "ecparam", "-name", "prime256v1", "-genkey", "-noout", "-out", f"{name}/key.pem"
        )
        self.openssl(
            "req",
            "-new",
            "-key",
            f"{name}/key.pem",
            "-subj",
            f"/O=Halcyon/CN={name}",
            "-out",
            f"{name}/request",
        )
        self.openssl(
            "x509",
            "-req",
            "-in",
            f"{name}/request",
            "-CA",
            f"{authority}.pem",
            "-CAkey",
            f"{authority}.key",
            "-CAcreateserial",
            "-days",
            3650,
            "-out",
            f"{name}/cert.pem",
        )
        for file in ("identity_ca.cert.pem", "permissions_ca.cert.pem"):
            shutil.copy(self.folder / f"{authority}.pem", self.folder / name / file)
        self.sign(authority, GOVERNANCE, f"{name}/governance.p7s")
        self.sign(authority, PERMISSIONS.format(name=name, topic=topic), f"{name}/permissions.p7s")
        return f"security={self.folder / name}"

    def test_only_participants_of_the_same_authority_exchange_a_topic(self):
        self.authority("authority")
        self.authority("other")
        self.publisher(4.5, more=self.enclave("arm"))
        self.subscriber(more="timeout_ms=60000 " + self.enclave("cell"))
        self.becomes("sub.valid", "TRUE")
        self.shows("4.5")
        self.becomes("pub.matched", "1", "publisher")
        self.prints("sub: not visible in hal top: Fast DDS created no writer for 'halcyon/status'")

        # The participants without permission start first, so that they had time for a sample when the permitted one has read its.
        without = self.rogue("listen")
        thief = self.rogue("listen", self.enclave("thief", "other"))
        tool = self.rogue("listen", self.enclave("tool"))
        self.reads_a_sample(tool)
        self.assertEqual("ready\n", self.end_rogue(without)[0])
        self.assertEqual("ready\n", self.end_rogue(thief)[0])

    def test_hal_top_with_a_certificate_shows_secured_instances(self):
        self.authority("authority")
        self.publisher(more=self.enclave("arm", topic="*"))
        domain, tool = f"domain={DOMAIN}", self.enclave("tool", topic="*")
        elsewhere = {
            "XDG_RUNTIME_DIR": str(self.folder / "tool")
        }  # so that it has the network only
        wait_until(
            lambda: '"publisher"'
            in self.good("top", "--json", "--dds", f"{domain} {tool}", environment=elsewhere),
            "hal top sees it",
        )
        self.assertEqual("[]\n", self.good("top", "--json", "--dds", domain, environment=elsewhere))

    def test_a_topic_without_permission_is_denied_by_name(self):
        self.authority("authority")
        self.write(
            "bad.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt dds_publish names=pub topic=arm/state fields=a:float "
            f"domain={DOMAIN} {self.enclave('guest', topic='other/topic')}\n",
        )
        done = self.run_program("run", "--for", "10ms", "bad.hal")
        self.assertNotEqual(0, done.returncode)
        self.assertIn("arm/state", done.stderr)
        self.assertIn("Fast DDS created no ", done.stderr)

    def test_a_folder_with_a_missing_file_is_rejected_by_name(self):
        self.authority("authority")
        words = self.enclave("arm")
        (self.folder / "arm" / "key.pem").unlink()
        self.write(
            "bad.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt dds_publish names=pub topic=arm/state fields=a:float "
            f"domain={DOMAIN} {words}\n",
        )
        self.assertIn(
            "arm/key.pem; the folder needs identity_ca.cert.pem, cert.pem, key.pem, ",
            self.run_program("run", "--for", "10ms", "bad.hal").stderr,
        )


if __name__ == "__main__":
    unittest.main()
