// SPDX-License-Identifier: MIT
// The device types of LinuxCNC's lcec as a table: products, process data, modParams and pins.
// docs/internals/lcec-devices.md explains its lines.
#include "ethercat/config/lcec_devices.hpp"

namespace hal::ethercat::config {

// clang-format off
const char* const lcec_device_table = R"(
shape passive
devices passive 00000002
  EK1100          044C2C52
  EK1101          044D2C52
  EK1110          04562C52
  EK1122          04622C52
  EP1122          04624052

shape supply-5v
  sm 0 in
  pdo 1a00 6000:01/1=power-ok 6000:02/1=overload
devices supply-5v 00000002
  EL9505          25213052
  EL9508          25243052
  EL9510          25263052
  EL9512          25283052
  EL9515          252B3052

shape supply-ebus
  sm 0 in
  pdo 1a00 6000:01/1=us-undervoltage
  pdo 1a01 6010:01/1=up-undervoltage
devices supply-ebus 00000002
  EL9410          24C23052

shape digital-inputs
  sm 0 in
  N* pdo 1a00+1 6000+10:01/1
  N* din din-# in=6000+10:01
devices digital-inputs 00000002
  EL1002          03EA3052 2
  EL1004          03EC3052 4
  EL1008          03F03052 8
  EL1012          03F43052 2
  EL1014          03F63052 4
  EL1018          03FA3052 8
  EL1024          04003052 4
  EL1034          040A3052 4
  EL1084          043C3052 4
  EL1088          04403052 8
  EL1094          04463052 4
  EL1098          044A3052 8
  EL1104          04503052 4
  EL1114          045A3052 4
  EL1124          04643052 4
  EL1134          046E3052 4
  EL1144          04783052 4
  EL1804          070C3052 4
  EL1808          07103052 8
  EL1809          07113052 16
  EL1819          071B3052 16
  EP1008          03F04052 8
  EP1018          03FA4052 8
  EP1809          07114052 16
  EP1819          071B4052 16

shape digital-inputs-in-one-pdo
  sm 0 in
  pdo 1a00 N*3101:01+1/1
  N* din din-# in=3101:01+1
devices digital-inputs-in-one-pdo 00000002
  EL1014-legacy   03F63052 4

shape digital-inputs-in-two-pdos
  sm 0 in
  2* pdo 1a00+1 6000:01+1/1
  2* din din-# in=6000:01+1
devices digital-inputs-in-two-pdos 00000002
  EL1252          04E43052

shape digital-outputs
  sm 0 out
  N* pdo 1600+1 7000+10:01/1
  N* dout dout-# out=7000+10:01
devices digital-outputs 00000002
  EK1828-0010     07242C52 8
  EL2002          07D23052 2
  EL2004          07D43052 4
  EL2008          07D83052 8
  EL2022          07E63052 2
  EL2024          07E83052 4
  EL2032          07F03052 2
  EL2034          07F23052 4
  EL2042          07FA3052 2
  EL2084          08243052 4
  EL2088          08283052 8
  EL2124          084C3052 4
  EL2612          0A343052 2
  EL2622          0A3E3052 2
  EL2624          0A403052 4
  EL2634          0A4A3052 4
  EL2652          0A5C3052 2
  EL2808          0AF83052 8
  EL2798          0AEE3052 8
  EL2828          0B0C3052 8
  EP2008          07D84052 8
  EP2028          07EC4052 8

shape digital-outputs-16
  sm 0 out
  8* pdo 1600+1 7000+10:01/1
  sm 1 out
  8* pdo 1608+1 7080+10:01/1
  16* dout dout-# out=7000+10:01
devices digital-outputs-16 00000002
  EL2809          0AF93052
  EP2809          0AF94052

shape digital-in-and-out-from-8
  sm 0 out
  N* pdo 1608+1 7080+10:01/1
  sm 1 in
  N* pdo 1a00+1 6000+10:01/1
  N* din din-# in=6000+10:01
  N* dout dout-# out=7080+10:01
devices digital-in-and-out-from-8 00000002
  EL1852          073C3052 8
  EL1859          07433052 8
  EJ1859          07432852 8
  EK1814          07162C52 4

shape digital-4-4-from-4
  sm 0 out
  4* pdo 1604+1 7040+10:01/1
  sm 1 in
  4* pdo 1a00+1 6000+10:01/1
  4* din din-# in=6000+10:01
  4* dout dout-# out=7040+10:01
devices digital-4-4-from-4 00000002
  EP2308          09044052
  EP2318          090E4052
  EP2328          09184052

shape digital-in-and-out
  sm 0 out
  M* pdo 1600+1 7000+10:01/1
  sm 1 in
  N* pdo 1a00+1 6000+10:01/1
  N* din din-# in=6000+10:01
  M* dout dout-# out=7000+10:01
devices digital-in-and-out 00000002
  EK1818          071A2C52 8 4
  EK1828          07242C52 4 8
  EP2338          09224052 8
  EP2339          09234052 16
  EP2349          092D4052 16
  EQ2339          092D4052 16
  EPP2308         64765649 4
  EPP2318         647656E9 4
  EPP2328         64765789 4
  EPP2334         647657E9 4
  EPP2338         64765829 8
  EPP2339         64765839 8
  EPP2349         647658D9 8

shape digital-8-8-bytes
  sm 2 out
  pdo 1600 8*7000:01+1/1
  sm 3 in
  pdo 1a00 8*6000:01+1/1 /5 6000:0e/1 /2
  8* din din-# in=6000:01+1
  8* dout dout-# out=7000:01+1
devices digital-8-8-bytes 00000002
  EP2316          090C4052
  EPP2316         090C4052

shape digital-outputs-tristate
  sm 0 out write
  2* pdo 1600+1 7000+10:01/1=dout-# 7000+10:02/1=tristate-#
devices digital-outputs-tristate 00000002
  EL2202          089A3052

values valves sol-#-1a sol-#-1b sol-#-2a sol-#-2b sol-#-3a sol-#-3b sol-#-4a sol-#-4b
shape valves
  sm 2 out
  N* pdo 1600+1 3101:01+1/8{$valves}
devices valves 00000114
  EX260-SEC1      01000001 4
  EX260-SEC2      01000002 4
  EX260-SEC3      01000003 2
  EX260-SEC4      01000004 2

values analog-status 6000+10:01/1 6000+10:02/1 6000+10:03/2 6000+10:05/2 6000+10:07/1
values analog-errors under=6000+10:01 over=6000+10:02 error=6000+10:07

shape analog-inputs
  sm 3 in
  N* pdo 1a00+2 $analog-status /7 6000+10:0f/1 6000+10:10/1 6000+10:11/16s
  M* ain ain-# val=6000+10:11 $analog-errors
devices analog-inputs 00000002
  EL3001          0BB93052 1
  EL3002          0BBA3052 2
  EL3004          0BBC3052 4
  EL3008          0BC03052 8
  EL3011          0BC33052 1
  EL3012          0BC43052 2
  EL3014          0BC63052 4 3
  EL3021          0BCD3052 1
  EL3022          0BCE3052 2
  EL3024          0BD03052 4
  EL3041          0BE13052 1
  EL3042          0BE23052 2
  EL3044          0BE43052 4
  EL3048          0BE83052 8
  EL3051          0BEB3052 1
  EL3052          0BEC3052 2
  EL3054          0BEE3052 4
  EL3058          0BF23052 8
  EL3061          0BF53052 1
  EL3062          0BF63052 2
  EL3064          0BF83052 4
  EL3068          0BFC3052 8
  EJ3004          0BBC2852 4

shape analog-inputs-16-bit
  sm 3 in
  N* pdo 1a00+2 $analog-status /6 6000+10:0e/1 6000+10:0f/1 6000+10:10/1 6000+10:11/16s
  N* ain ain-# val=6000+10:11 $analog-errors sync=6000+10:0e
devices analog-inputs-16-bit 00000002
  EL3101          0C1D3052 1
  EL3104          0C203052 4
  EL3111          0C273052 1
  EL3114          0C2A3052 4
  EL3121          0C313052 1
  EL3124          0C343052 4
  EL3141          0C453052 1
  EL3144          0C483052 4
  EL3151          0C4F3052 1
  EL3154          0C523052 4
  EL3161          0C593052 1
  EL3164          0C5C3052 4
  EL3182          0C6E3052 2
  EP3174          0C664052 4
  EP3184          0C704052 4
  EPX3158         9809AB69 8

shape analog-inputs-2-status-byte
  sm 3 in write
  2* pdo 1a00+1 3101+1:01/8 3101+1:02/16s
  2* ain ain-# val=3101+1:02 under=3101+1:01.0 over=3101+1:01.1 error=3101+1:01.6
devices analog-inputs-2-status-byte 00000002
  EL3102          0C1E3052
  EL3112          0C283052
  EL3122          0C323052
  EL3142          0C463052
  EL3152          0C503052
  EL3162          0C5A3052

shape potentiometers
  sm 3 in write
  5* pdo 1a00+2 $analog-status /1 /5 6000+10:0e/1 6000+10:0f/1 6000+10:10/1 6000+10:11/16s
  5* ain pot-# val=6000+10:11 $analog-errors sync=6000+10:0e
devices potentiometers 00000002
  EL3255          0CB73052

shape temperature-inputs
  N* param ch#Sensor 8000+10:19/16 for=temp-# Pt100=0;scale=0.1 Ni100=1;scale=0.1
      Pt1000=2;scale=0.1 Pt500=3;scale=0.1 Pt200=4;scale=0.1 Ni1000=5;scale=0.1
      Ni1000-TK5000=6;scale=0.1 Ni120=7;scale=0.1 Ohm/16=8;scale=0.0625;unsigned=1
      Ohm/64=9;scale=0.015625;unsigned=1
  N* param ch#Resolution 8000+10:02/8 Signed=0,Standard=0,High=2;scale*=0.1 for=temp-#
  N* param ch#Wires 8000+10:1a/16 2=0,3=1,4=2
  sm 3 in
  N* pdo 1a00+1 $analog-status /7 6000+10:0f/1 6000+10:10/1 6000+10:11/16s
  N* ain temp-# val=6000+10:11 $analog-errors temperature=1
devices temperature-inputs 00000002
  EJ3202          0C822852 2
  EJ3214          0C8E2852 4
  EL3201          0C813052 1
  EL3202          0C823052 2
  EL3204          0C843052 4
  EL3208          0C883052 8
  EL3214          0C8E3052 4
  EL3218          0C923052 8
  EP3204          0C844052 4

shape pressure-inputs
  sm 3 in
  N* pdo 1a00+1 $analog-status /7 6000+10:0f/1 /1 6000+10:11/16s
  N* ain press-# val=6000+10:11 pressure=1
  N* flag pressure-#-error val=6000+10:07
  N* flag pressure-#-overrange val=6000+10:02
  N* flag pressure-#-underrange val=6000+10:01
devices pressure-inputs 00000002
  EM3701          0E753452 1
  EM3702          0E763452 2
  EM3712          0E803452 2

shape power-measurement
  sm 2 out write
  3* pdo 1600+1 7000+10:01/8
  sm 3 in write
  3* pdo 1a00+1 /13 6000+10:0e/1=l#.sync-error /1 1800+1:09/1=l#.txpdo-toggle 6000+10:11/32s
      6000+10:12/32s 6000+10:13/32s 6000+10:14/8 /8 6000+10:1d/32s
  pdo 1a03 /3 f100:04/1=l0.missing-zero-crossing f100:05/1=l1.missing-zero-crossing
      f100:06/1=l2.missing-zero-crossing /2 f100:09/1=sync-error-status /4
      f100:0e/1=phase-sequence-error /2
  3* scaled l#.current val=6000+10:11 factor=0.000005
  3* scaled l#.voltage val=6000+10:12 factor=0.0001
  3* scaled l#.active-power val=6000+10:13 factor=0.01
  3* power-values l#. request=7000+10:01 selector=6000+10:14 val=6000+10:1d
devices power-measurement 00000002
  EL3403          0D4B3052

shape analog-outputs
  sm 2 out
  N* pdo 1600+1 7000+10:01/16s
  N* aout aout-# val=7000+10:01
devices analog-outputs 00000002
  EL4001          0FA13052 1
  EL4011          0FAB3052 1
  EL4021          0FB53052 1
  EL4031          0FBF3052 1
  EL4002          0FA23052 2
  EL4012          0FAC3052 2
  EL4022          0FB63052 2
  EL4032          0FC03052 2
  EJ4002          0FA22852 2
  EL4004          0FA43052 4
  EL4014          0FAE3052 4
  EL4024          0FB83052 4
  EL4034          0FC23052 4
  EJ4004          0FA42852 4
  EJ4024          0FB82852 4
  EL4008          0FA83052 8
  EL4018          0FB23052 8
  EL4028          0FBC3052 8
  EL4038          0FC63052 8
  EJ4008          0FA82852 8
  EJ4018          0FB22852 8
  EL4104          10083052 4
  EL4114          10123052 4
  EL4124          101C3052 4
  EL4134          10263052 4
  EJ4134          10262852 4
  EP4174          104E4052 4

shape analog-outputs-2-legacy
  sm 2 out write
  2* pdo 1600+1 3001+1:01/16s
  2* aout aout-# val=3001+1:01
devices analog-outputs-2-legacy 00000002
  EL4102          10063052
  EL4112          10103052
  EL4122          101A3052
  EL4132          10243052
  EJ4132          10242852

shape pulse-train-2
  2* param ch##OutputMode 8000+10:0e/8
      FrequencyModulation=0,PulseDirection=1,IncrementalEncoder=2
  2* param ch##FrequencyLimit 8000+10:12/32
  sm 2 out write
  pdo 1601 /3 7000:04/1 7000:05/1 7000:06/1 /10 7000:12/32
  pdo 1606 /3 7010:04/1 7010:05/1 7010:06/1 /10 7010:12/32
  pdo 160b /2 7020:03/1 /12 7020:10/1 7020:11/32
  pdo 160d /2 7030:03/1 /12 7030:10/1 7030:11/32
  sm 3 in write
  2* pdo 1a03+2 /2 6020+10:03/1 6020+10:04/1 6020+10:05/1 /8 6020+10:0e/1 6020+10:0f/1
      6020+10:10/1 6020+10:11/32
  2* pulse-train ch##. count=6020+10:11 enable=7000+10:04 target=7000+10:12
devices pulse-train-2 00000002
  EL2522          09DA3052

shape frequency-output
  sm 2 out write
  pdo 1600 7000:01/16 7000:02/16s
  sm 3 in write
  pdo 1a00 6000:01/16 6000:02/16
  frequency-output stp state=6000:01 count=6000:02 control=7000:01 target=7000:02
devices frequency-output 00000002
  EL2521          09D93052

shape ssi-2
  2* param ch#DisFrameErr 8000+10:01/8
  2* param ch#EnPwrFailChk 8000+10:02/8
  2* param ch#EnInhibitTime 8000+10:03/8
  2* param ch#Coding 8000+10:06/8
  2* param ch#Baudrate 8000+10:09/8
  2* param ch#ClkJitComp 8000+10:0c/8
  2* param ch#FrameType 8000+10:0f/8
  2* param ch#FrameSize 8000+10:11/16
  2* param ch#DataLen 8000+10:12/16
  2* param ch#MinInhibitTime 8000+10:13/16
  2* param ch#NoClkBursts 8000+10:14/16
  sm 3 in write
  2* pdo 1a00+1 6000+10:01/1=enc-#-err-data 6000+10:02/1=enc-#-err-frame
      6000+10:03/1=enc-#-err-power 6000+10:04/1 /9 6000+10:0e/1=enc-#-err-sync
      6000+10:0f/1=enc-#-tx-state 6000+10:10/1=enc-#-tx-toggle 6000+10:11/32s
  2* counter enc-# count=6000+10:11 absolute=1
devices ssi-2 00000002
  EL5002          138A3052
  EJ5002          138A2852

shape endat-2
  sm 3 in write
  2* pdo 1a00+1 6000+10:01/1=enc-#-warn 6000+10:02/1=enc-#-error 6000+10:03/1=enc-#-ready /5 /4
      6000+10:0d/1=enc-#-diag 6000+10:0e/1=enc-#-tx-state 6000+10:0f/2s 6000+10:11/64s
  2* number enc-#-cyc-cnt val=6000+10:0f
  2* counter enc-# count=6000+10:11 absolute=1
devices endat-2 00000002
  EL5032          13A83052

values counter count=6000+10:11 latch=6000+10:12 valid-ext=6000+10:02 set-done=6000+10:03
      enable-pos=7000+10:02 set=7000+10:03 enable-neg=7000+10:04 set-value=7000+10:11
values counter-c valid-c=6000+10:01 enable-c=7000+10:01

shape encoder-5101
  sm 2 out write
  pdo 1600 7000:01/8 7000:02/16s
  sm 3 in write
  pdo 1a00 6000:01/8{-,-,-,enc-underflow,enc-overflow,enc-inext} 6000:02/16s 6000:03/16s
  pdo 1a02 6000:04/32 6000:05/16 6000:06/16
  counter enc count=6000:02 latch=6000:03 valid-c=6000:01.0 valid-ext=6000:01.1
      set-done=6000:01.2 enable-c=7000:01.0 enable-pos=7000:01.1 set=7000:01.2
      enable-neg=7000:01.3 set-value=7000:02 frequency=6000:04 period=6000:05 window=6000:06
      period-scale=5e-7
devices encoder-5101 00000002
  EL5101          13ED3052

shape encoder-5102
  sm 2 out
  2* pdo 1605+6 7000+10:01/1 7000+10:02/1 7000+10:03/1 7000+10:04/1 /12 7000+10:11/16s
  sm 3 in
  2* pdo 1a05+d 6000+10:01/1 6000+10:02/1 6000+10:03/1 6000+10:04/1=enc-#-underflow
      6000+10:05/1=enc-#-overflow 6000+10:06/1 6000+10:07/1 6000+10:08/1 6000+10:09/1
      6000+10:0a/1 6000+10:0b/1 6000+10:0c/1 6000+10:0d/1=enc-#-inext 6000+10:0e/1 6000+10:0f/1
      6000+10:10/1 6000+10:11/16s 6000+10:12/16s
  2* counter enc-# $counter $counter-c
devices encoder-5102 00000002
  EL5102          13EE3052

shape encoder-5151
  sm 2 out write
  pdo 1600 7000:01/1 7000:02/1 7000:03/1 7000:04/1 /4 /8 7000:11/32s
  sm 3 in write
  pdo 1a00 6000:01/1 6000:02/1 6000:03/1 /4 6000:08/1=enc-expol-stall 6000:09/1=enc-ina
      6000:0a/1=enc-inb 6000:0b/1=enc-inc /1 6000:0d/1=enc-inext 1c32:20/1=enc-sync-error /1
      1800:09/1=enc-tx-toggle 6000:11/32s 6000:12/32s
  pdo 1a02 6000:14/32
  counter enc $counter $counter-c period=6000:14
devices encoder-5151 00000002
  EL5151          141F3052

shape encoder-5152-inputs
  pdo 1a00+4 /2 6000+10:03/1 /4 6000+10:08/1=enc-#-expol-stall 6000+10:09/1=enc-#-ina
      6000+10:0a/1=enc-#-inb /3 1c32:20/1 /1 1800+4:09/1=enc-#-tx-toggle 6000+10:11/32s
  pdo 1a02+4 6000+10:14/32
shape encoder-5152
  sm 2 out write
  2* pdo 1600+2 /1 /1 7000+10:03/1 /1 /4 /8 7000+10:11/32s
  sm 3 in write
  2* like encoder-5152-inputs
  2* counter enc-# count=6000+10:11 set-done=6000+10:03 set=7000+10:03 set-value=7000+10:11
      period=6000+10:14 index=1
devices encoder-5152 00000002
  EL5152          14203052

shape axis-interface-4
  sm 2 out
  pdo 1601 16*7010:01+1/1
  4* pdo 1602+1 7020+10:11/16s
  4* pdo 1606+1 /1 7060+10:02/1 7060+10:03/1 7060+10:04/1 /12 7060+10:11/16s
  sm 3 in
  pdo 1a00 16*6000:01+1/1
  4* pdo 1a06+1 /1 6060+10:02/1 6060+10:03/1 /5 6060+10:09/1=enc-#-ina 6060+10:0a/1=enc-#-inb /1
      6060+10:0c/1=enc-#-ingate 6060+10:0d/1=enc-#-inext /3 6060+10:11/16s 6060+10:12/16s
  16* din din-# in=6000:01+1
  16* dout dout-# out=7010:01+1
  4* aout aout-# val=7020+10:11
  4* counter enc-# count=6060+10:11 latch=6060+10:12 valid-ext=6060+10:02 set-done=6060+10:03
      enable-pos=7060+10:02 set=7060+10:03 enable-neg=7060+10:04 set-value=7060+10:11
devices axis-interface-4 00000002
  EM7004          1B5C3452

values stepper-status 6010:01/1=srv-ready-to-enable 6010:02/1=srv-ready 6010:03/1=srv-warning
      6010:04/1=srv-error 6010:05/1=srv-move-pos 6010:06/1=srv-move-neg
      6010:07/1=srv-torque-reduced
values stepper-inputs 6010:0c/1=srv-din1 6010:0d/1=srv-din2 6010:0e/1=srv-sync-error /1
      6010:10/1=srv-tx-toggle

shape stepper-7041
  param maxCurrent 8010:01/16 *1000
  param reducedCurrent 8010:02/16 *1000
  param nominalVoltage 8010:03/16 *1000
  param coilResistance 8010:04/16 *1000
  param motorEMF 8010:05/16 *1000
  param motorFullsteps 8010:06/16
  param encoderIncrements 8010:07/16
  param startVelocity 8010:09/16
  param driveOnDelay 8010:10/16
  param driveOffDelay 8010:11/16
  param maxSpeed 8012:05/16 1000=0,2000=1,4000=2,8000=3,16000=4,32000=5
  param encoder 8012:08/8
  param microsteps 8012:45/8 1=0,2=1,4=2,8=3,16=4,32=5,64=6
  sm 2 out write
  pdo 1600 7000:01/1 7000:02/1 7000:03/1 7000:04/1 /4 /8 7000:11/16s
  pdo 1602 7010:01/1 7010:02/1 7010:03/1=srv-reduce-torque /5 /8
  pdo 1604 7010:21/16s
  sm 3 in write
  pdo 1a00 6000:01/1 6000:02/1 6000:03/1 6000:04/1=enc-count-underflow
      6000:05/1=enc-count-overflow /2 6000:08/1=enc-expol-stall 6000:09/1=enc-ina
      6000:0a/1=enc-inb 6000:0b/1=enc-inc /1 6000:0d/1=enc-inext 6000:0e/1=enc-sync-error /1
      6000:10/1=enc-tx-toggle 6000:11/16s 6000:12/16s
  pdo 1a03 $stepper-status /4 $stepper-inputs
  counter enc $counter $counter-c latch-c-name=1
  aout srv val=7010:21 enable=7010:01 motor=1
  motor-reset srv error=6010:04 enable=7010:01 reset=7010:02
devices stepper-7041 00000002
  EL7041,EP7041,EL7041_1000,EL7041-1000 1B813052

shape stepper-settings
  param maxCurrent 8010:01/16
  param redCurrent 8010:02/16
  param nomVoltage 8010:03/16
  param coilRes 8010:04/16
  param motorEMF 8010:05/16
  sdo 8012:01/8 3
shape stepper-7031
  like stepper-settings
  sm 2 out write
  pdo 1601 /1 7000:02/1 7000:03/1 7000:04/1 /4 /8 7000:11/32
  pdo 1602 7010:01/1 7010:02/1 7010:03/1 /5 /8
  pdo 1603 7010:11/32s
  sm 3 in write
  pdo 1a01 /1 6000:02/1 6000:03/1 6000:04/1 6000:05/1 /3 /4 6000:0d/1 6000:0e/1 /1 6000:10/1
      6000:11/32 6000:12/32
  pdo 1a03 $stepper-status /1 /3 $stepper-inputs
  stepper - enable=7010:01 reset=7010:02 reduce=7010:03 target=7010:11
devices stepper-7031 00000002
  EL7031          1B773052

shape stepper-7041-0052
  like stepper-settings
  sm 2 out write
  pdo 1602 7010:01/1 7010:02/1 7010:03/1 /5 /8
  pdo 1603 7010:11/32s
  sm 3 in write
  pdo 1a03 $stepper-status /1 /3 $stepper-inputs
  stepper - enable=7010:01 reset=7010:02 reduce=7010:03 target=7010:11
devices stepper-7041-0052 00000002
  EL7041-0052     1B813052

shape dc-motor-outputs
  pdo 1604+3 7020+10:01/1 7020+10:02/1=srv-#-reset 7020+10:03/1=srv-#-reduce-torque /5 /8
  pdo 1606+3 7020+10:21/16s
shape dc-motor-inputs
  pdo 1a06+2 6020+10:01/1=srv-#-ready-to-enable 6020+10:02/1=srv-#-ready
      6020+10:03/1=srv-#-warning 6020+10:04/1=srv-#-error 6020+10:05/1=srv-#-move-pos
      6020+10:06/1=srv-#-move-neg 6020+10:07/1=srv-#-torque-reduced /1 /3
      6020+10:0c/1=srv-#-din1 6020+10:0d/1=srv-#-din2 1c32:20/1=srv-#-sync-error /1
      1806+2:09/1=srv-#-tx-toggle
  pdo 1a07+2 6020+10:11/16s=srv-#-raw-info1 6020+10:12/16s=srv-#-raw-info2
shape dc-motor-2
  sm 2 out write
  2* pdo 1600+2 /1 7000+10:02/1 7000+10:03/1 7000+10:04/1 /4 /8 7000+10:11/16s
  2* like dc-motor-outputs
  sm 3 in write
  2* pdo 1a00+3 /1 6000+10:02/1 6000+10:03/1 6000+10:04/1=enc-#-count-underflow
      6000+10:05/1=enc-#-count-overflow /2 6000+10:08/1=enc-#-expol-stall 6000+10:09/1=enc-#-ina
      6000+10:0a/1=enc-#-inb /1 /1 6000+10:0d/1=enc-#-inext 1c32:20/1=enc-#-sync-error /1
      1800+3:09/1=enc-#-tx-toggle 6000+10:11/16s 6000+10:12/16s
  2* like dc-motor-inputs
  2* counter enc-# $counter
  2* aout srv-# val=7020+10:21 enable=7020+10:01 motor=1
  2* object-value srv-#-sel-info1 object=8022+10:11 bits=8
  2* object-value srv-#-sel-info2 object=8022+10:19 bits=8
devices dc-motor-2 00000002
  EL7342          1CAE3052

shape delta-inverter
  sm 2 out write
  pdo 1600 6040:00/16 6042:00/16s 6060:00/8s /8
  pdo 1601 6050:00/32=vel-ramp-down 604f:00/32=vel-ramp-up
  sm 3 in write
  pdo 1a00 6041:00/16 6043:00/16s 6061:00/8s /8
  pdo 1a01 3021:05/16 3021:01/16 3022:0f/16
  inverter - status=6041:00 control=6040:00 target=6042:00 velocity=6043:00 mode=6060:00
      mode-display=6061:00
  scaled act-current val=3021:05 factor=0.01 unsigned=1
  scaled drive-temp val=3022:0f factor=0.1 unsigned=1
  number error-code val=3021:01.0/8 unsigned=1
  number warn-code val=3021:01.8/8 unsigned=1
devices delta-inverter 000001DD
  DeMS300         10400200

values delta-outputs - - - - - - - - - - - - - - - - dout-d01 dout-d02 dout-d03 dout-d04
values delta-inputs din-neg-lim din-pos-lim din-home - - - - - - - - - - - - - din-1 din-2 din-3
      din-4 din-5 din-6 din-7
values delta-servo status=6041:00 control=6040:00 velocity=606c:00 position=6064:00
      external=2511:00 torque=6077:00 steps=N

shape delta-servo
  option opmode CSV CSP
  option enableDigitalOutput 1 0
  [enableDigitalOutput=1] sdo 60fe:02/32 0x000f0000
  [opmode=CSV] sdo 6060:00/8 9
  [opmode=CSP] sdo 6060:00/8 8
  sdo 60c2:01/8 @mantissa
  sdo 60c2:02/8 @exponent
  sm 2 out write
  [opmode=CSV] pdo 1602 6040:00/16 60ff:00/32s
  [opmode=CSP] pdo 1602 6040:00/16 607a:00/32s
  [enableDigitalOutput=1] entries 60fe:01/32{$delta-outputs}
  sm 3 in write
  pdo 1a02 6041:00/16 606c:00/32s 6064:00/32s 2511:00/32s 6077:00/16s 60fd:00/32{$delta-inputs}
  [opmode=CSV] delta-servo - target=60ff:00 velocity-mode=1 $delta-servo
  [opmode=CSP] delta-servo - target=607a:00 velocity-mode=0 $delta-servo
devices delta-servo 000001DD
  DeASDA          10305070 1280000
  DeASDA3         00006010 16777216
  DeASDB3         00006080 16777216 enableDigitalOutput=0

values omron-status stat-switchon-ready stat-switched-on stat-op-enabled stat-fault
      stat-volt-enabled stat-quick-stop stat-switchon-disabled stat-warning - stat-remote
values omron-inputs din-not din-pot din-dec - - - - - - - - - - - - - din-pc din-ext1 din-ext2
      din-ext3 din-mon0 din-mon1 din-mon2 din-pcl din-ncl din-stop din-bkir din-sf1 din-sf2
      din-edm

shape omron-servo
  sdo 6060:00/8 8
  sm 2 out write
  pdo 1701 6040:00/16 607a:00/32s 60b8:00/16 60fe:01/32
  sm 3 in write
  pdo 1b01 603f:00/16=error-code 6041:00/16{$omron-status} 6064:00/32s 6077:00/16s 60f4:00/32s
      60b9:00/16 60ba:00/32s 60bc:00/32s 60fd:00/32{$omron-inputs}
  position-drive - status=6041:00 control=6040:00 target=607a:00 position=6064:00
      following-error=60f4:00 torque=6077:00 scale=N
devices omron-servo 00000083
  R88D-1SN01H-ECT 000000AE 8388608
  R88D-1SN01L-ECT 000000AB 8388608
  R88D-1SN02H-ECT 000000AF 8388608
  R88D-1SN02L-ECT 000000AC 8388608
  R88D-1SN04H-ECT 000000B0 8388608
  R88D-1SN04L-ECT 000000AD 8388608
  R88D-1SN06F-ECT 000000BE 8388608
  R88D-1SN08H-ECT 000000B1 8388608
  R88D-1SN10F-ECT 000000B6 8388608
  R88D-1SN10H-ECT 000000B2 8388608
  R88D-1SN15F-ECT 000000B7 8388608
  R88D-1SN15H-ECT 000000B3 8388608
  R88D-1SN20F-ECT 000000B8 8388608
  R88D-1SN20H-ECT 000000B4 8388608
  R88D-1SN30F-ECT 000000B9 8388608
  R88D-1SN30H-ECT 000000B5 8388608
  R88D-1SN55F-ECT 000000EA 8388608
  R88D-1SN55H-ECT 000000E7 8388608
  R88D-1SN75F-ECT 000000EB 8388608
  R88D-1SN75H-ECT 000000E8 8388608
  R88D-1SN150F-ECT 000000EC 8388608
  R88D-1SN150H-ECT 000000E9 8388608
  R88D-KNA5L-ECT,OmrG5_KNA5L 00000001 1048576
  R88D-KN01L-ECT,OmrG5_KN01L 00000002 1048576
  R88D-KN02L-ECT,OmrG5_KN02L 00000003 1048576
  R88D-KN04L-ECT,OmrG5_KN04L 00000004 1048576
  R88D-KN01H-ECT,OmrG5_KN01H 00000005 1048576
  R88D-KN02H-ECT,OmrG5_KN02H 00000006 1048576
  R88D-KN04H-ECT,OmrG5_KN04H 00000007 1048576
  R88D-KN08H-ECT,OmrG5_KN08H 00000008 1048576
  R88D-KN10H-ECT,OmrG5_KN10H 00000009 1048576
  R88D-KN15H-ECT,OmrG5_KN15H 0000000A 1048576
  R88D-KN20H-ECT,OmrG5_KN20H 00000056 1048576
  R88D-KN30H-ECT,OmrG5_KN30H 00000057 1048576
  R88D-KN50H-ECT,OmrG5_KN50H 00000058 1048576
  R88D-KN75H-ECT,OmrG5_KN75H 00000059 1048576
  R88D-KN150H-ECT,OmrG5_KN150H 0000005A 1048576
  R88D-KN06F-ECT,OmrG5_KN06F 0000000B 1048576
  R88D-KN10F-ECT,OmrG5_KN10F 0000000C 1048576
  R88D-KN15F-ECT,OmrG5_KN15F 0000000D 1048576
  R88D-KN20F-ECT,OmrG5_KN20F 0000005B 1048576
  R88D-KN30F-ECT,OmrG5_KN30F 0000005C 1048576
  R88D-KN50F-ECT,OmrG5_KN50F 0000005D 1048576
  R88D-KN75F-ECT,OmrG5_KN75F 0000005E 1048576
  R88D-KN150F-ECT,OmrG5_KN150F 0000005F 1048576

values rtelligent-stepper-outputs custom=0 general=0 alarm=1 brake=2 in-place=3
values rtelligent-stepper-inputs general=0 cw_limit=1 cw-limit=1 ccw_limit=2 ccw-limit=2 home=3
      clear_fault=4 clear-fault=4 emergency_stop=5 emergency-stop=5 motor_offline=6
      motor-offline=6 probe1=7 probe2=8
values rtelligent-stepper enablePV=0 enableCSP=1 enableHM=1 enableHomeAccel=1
      enableActualFollowingError=1 enableActualTorque=1 enableErrorCode=1 enableDigitalInput=1
      enableDigitalOutput=1 digitalInChannels=6 digitalOutChannels=2

shape rtelligent-stepper-axis
  param %peakCurrent_amps 2000+800:00/16 *1000
  param %motorResolution_pulses 2001+800:00/16
  param %standbyTime_ms 2002+800:00/16
  param %standbyCurrent_pct 2003+800:00/16
  param %output1Func 2005+800:01/16 $rtelligent-stepper-outputs
  param %output2Func 2005+800:02/16 $rtelligent-stepper-outputs
  param %input3Func 2007+800:03/16 $rtelligent-stepper-inputs
  param %input4Func 2007+800:04/16 $rtelligent-stepper-inputs
  param %input5Func 2007+800:05/16 $rtelligent-stepper-inputs
  param %input6Func 2007+800:06/16 $rtelligent-stepper-inputs
  param %filterTime_us 2009+800:00/16
  param %shaftLockTime_us 200a+800:00/16
  param %motorAutoTune 200b+800:01/16
  param %stepperPhases 200c+800:01/16 2=0,3=1
  param %controlMode 2011+800:00/16 openloop=0,closedloop=1,foc=2
  param %encoderResolution 2020+800:00/16
  param %positionErrorLimit 2022+800:00/16
shape rtelligent-stepper
  dc 300
  like rtelligent-stepper-axis
  cia402 $rtelligent-stepper
  pdo 1a01 200e:00/16=alarm-code 200f:00/16=status-code 2048:00/16
  scaled voltage val=2048:00 factor=0.01 unsigned=1
devices rtelligent-stepper 00000A88
  ECR60           0A880001
  ECR86           0A880003
  ECT60           0A880002
  ECT86           0A880004

shape rtelligent-stepper-2
  dc 300
  2* like rtelligent-stepper-axis ch##
  cia402 ciaChannels=2 pdoIncrement=16 $rtelligent-stepper
devices rtelligent-stepper-2 00000A88
  ECR60x2         0A880005
  ECT60x2         0A880006

values rtelligent-servo-inputs general=0 normal=0 gpio=0 servo_enable=1 alarm_clear=2
      pulse_command_prohibition=3 clear_position_deviation=4 positive_limit=5 negative_limit=6
      gain_switching=7 egear_switching=8 zero-speed_clamp=9 control_mode_selection_1=10 estop=11
      position_command_prohibition=12 step_position_trigger=13
      multi_segment_run_command_switching_1=14 multi_segment_run_command_switching_2=15
      multi_segment_run_command_switching_3=16 multi_segment_run_command_switching_4=17
      torque_command_direction_setting=18 speed_command_direction_setting=19
      position_command_direction_setting=20 multi_segment_position_command_enable=21
      back_to_home_input=22 home=23 user1=24 user2=25 user3=26 user4=27 user5=28
      control_mode_selection_2=29 probe1=30 probe2=31
values rtelligent-servo-outputs brake=0 alarm=1 position_reached=2 speed_reached=3 servo_ready=4
      internal_position_command_stop=5 return_to_origin_completed=6 user1=7 user2=8 user3=9
      user4=10 user5=11 torque_reached=12 out_of_tolerance_output=13 general=31 gpio=31

shape rtelligent-servo
  dc 300
  8* param input##Func 2004:01+2/16 $rtelligent-servo-inputs
  4* param output##Func 2005:01+2/16 $rtelligent-servo-outputs
  cia402 ciaRxPDOEntryLimit=32 ciaTxPDOEntryLimit=32 enablePP=1 enablePV=1 enableCSP=1
      enableActualFollowingError=1 enableActualTorque=1 enableErrorCode=1 enablePositionDemand=1
      enableProbeStatus=1 enableTorqueDemand=1 enableProfileVelocity=1 enableTargetTorque=1
      enableDigitalInput=1 enableDigitalOutput=1 digitalInChannels=8 digitalOutChannels=4
      enableFollowingErrorTimeout=1 enableFollowingErrorWindow=1 enableHomeAccel=1
      enableMaximumCurrent=1 enableMaximumTorque=1 enablePolarity=1 enablePositioningTime=1
      enablePositioningWindow=1 enableProfileAccel=1 enableProfileDecel=1
      enableProfileMaxVelocity=1 enableTorqueSlope=1 enableVelocityErrorTime=1
      enableVelocityErrorWindow=1
devices rtelligent-servo 00000A88
  DRV400E         0A880042
  DRV750E         0A880043
  DRV1500E        0A880044

values lichuan-stepper pdoIncrement=16 enableCSP=1 enableCSV=1 enablePV=0 enableHM=1
      enableActualFollowingError=1 enableErrorCode=1 enableDigitalInput=1 enableDigitalOutput=1
      digitalInChannels=3 digitalOutChannels=2

shape lichuan-stepper-4
  dc 300
  cia402 ciaChannels=4 $lichuan-stepper enableActualTorque=1
devices lichuan-stepper-4 00000A79
  CL57E-4A        00006100

shape lichuan-stepper-4-open
  dc 300
  cia402 ciaChannels=4 $lichuan-stepper
devices lichuan-stepper-4-open 00000A79
  OL57E-4A        00006000

shape omron-mx2
  cia402 pdoAutoflow=1 pdoEntryLimit=2 pdoIncrement=1 enablePV=0 enableVL=1 enableErrorCode=1
devices omron-mx2 00000083
  OMMX2           00000053

shape servo-terminal
  sm 2 out write
  pdo 1600 7010:01/16
  pdo 1601 7010:06/32s
  sm 3 in write
  pdo 1a00 6000:11/32s
  pdo 1a01 6010:01/16
  pdo 1a02 6010:07/32s
  velocity-drive - status=6010:01 control=7010:01 target=7010:06 velocity=6010:07
      position=6000:11
devices servo-terminal 00000002
  EL7211          1C2B3052
  EL7221          1C353052

shape servo-terminal-inputs
  sdo 8010:39/8 10
  like servo-terminal
  pdo 1a04 6010:12/16
  din input-0 in=6010:12.0
  din input-1 in=6010:12.1
  flag input-sto val=6010:12.8
devices servo-terminal-inputs 00000002
  EL7201_9014     1C213052

shape servo-terminal-dc
  sdo 7010:03/8 9
  sdo 8010:64/8 2
  sdo 800a:02/8 1
  param dcLinkNominal 8010:19/32
  param dcLinkMin 8010:1a/32
  param dcLinkMax 8010:1b/32
  param maxCurrent 8011:11/32
  param ratedCurrent 8011:12/32
  param ratedVoltage 8011:2f/32
  param polePairs 8011:13/8
  param coilRes 8011:30/32
  param coilInd 8011:19/16
  param torqueConst 8011:16/32
  param voltageConst 8011:31/32
  param rotorInertia 8011:18/32
  param maxSpeed 8011:1b/32
  param ratedSpeed 8011:2e/32
  param thermalTimeConst 8011:2d/16
  param hallVoltage 800a:11/32
  param hallAdjust 800a:13/8
  like servo-terminal
devices servo-terminal-dc 00000002
  EL7411          1CF33052

shape leadshine-inputs
  entries 60fd+800:00/32
  din %-din-negative-limit in=60fd+800:00.0
  din %-din-positive-limit in=60fd+800:00.1
  din %-din-home in=60fd+800:00.2
  din %-din-probe1 in=60fd+800:00.26
  din %-din-probe2 in=60fd+800:00.27
  din %-din-index-z in=60fd+800:00.31
  din %-din-quick-stop in=60fd+800:00.23
  din %-din-1 in=60fd+800:00.4
  din %-din-2 in=60fd+800:00.5
  din %-din-3 in=60fd+800:00.6
  din %-din-4 in=60fd+800:00.7
shape leadshine-closed-settings
  param %peakCurrent_amps 2000+800:00/16 *10
  param %controlMode 2024+800:00/16 openloop=0,closedloop=2

shape leadshine-stepper-2
  dc 700 sync1
  2* param ch##peakCurrent_amps 2000+800:00/16 *1000
  cia402 ciaChannels=2 enablePV=0 enableCSP=1 enableDigitalOutput=1 digitalOutChannels=2
  2* like leadshine-inputs srv-##
devices leadshine-stepper-2 00004321
  2EM3E-D522      0000A300
  2EM3E-D556      0000A100
  2EM3E-D870      0000A200

shape leadshine-stepper-2-closed
  dc 700 sync1
  2* like leadshine-closed-settings ch##
  cia402 ciaChannels=2 enablePV=0 enableCSP=1 enableDigitalOutput=1 digitalOutChannels=2
  2* like leadshine-inputs srv-##
devices leadshine-stepper-2-closed 00004321
  2CS3E-D503      00002200
  2CS3E-D507      00002100

shape leadshine-stepper
  dc 300
  param peakCurrent_amps 2000:00/16 *1000
  cia402 enablePV=0 enableCSP=1 enableDigitalOutput=1 digitalOutChannels=2
  like leadshine-inputs srv
devices leadshine-stepper 00004321
  EM3E-522E       00008800
  EM3E-556E       00008600
  EM3E-870E       00008700

shape leadshine-stepper-closed
  dc 300
  like leadshine-closed-settings
  cia402 enablePV=0 enableCSP=1 enableDigitalOutput=1 digitalOutChannels=2
  like leadshine-inputs srv
devices leadshine-stepper-closed 00004321
  CS3E-D503       00001300
  CS3E-D507       00001100
  CS3E-D1008      00001200
  CS3E-D503E      00000700
  CS3E-D507E      00000500

shape safety-logic
  fsoe-logic
devices safety-logic 00000002
  EL6900          1AF43052

shape safe-inputs
  fsoe 1 1 1
  sm 2 out
  pdo 1600 7000:01/8 /8 7000:02/16 7000:03/16
  sm 3 in
  pdo 1a00 6000:01/8=fsoe-slave-cmd 4*6001:01+1/1 /4 6000:03/16=fsoe-slave-crc
      6000:04/16=fsoe-slave-connid
  number fsoe-master-cmd val=7000:01 unsigned=1
  number fsoe-master-crc val=7000:02 unsigned=1
  number fsoe-master-connid val=7000:03 unsigned=1
  4* din fsoe-in-# in=6001:01+1
devices safe-inputs 00000002
  EL1904          07703052

shape safe-outputs
  fsoe 1 1 1
  sm 2 out
  pdo 1600 7000:01/8 4*7001:01+1/1 /4 7000:02/16 7000:03/16
  pdo 1601 4*7010:01+1/1=out-# /4
  sm 3 in
  pdo 1a00 6000:01/8=fsoe-slave-cmd /8 6000:03/16=fsoe-slave-crc 6000:04/16=fsoe-slave-connid
  number fsoe-master-cmd val=7000:01 unsigned=1
  number fsoe-master-crc val=7000:02 unsigned=1
  number fsoe-master-connid val=7000:03 unsigned=1
  4* flag fsoe-out-# val=7001:01+1
devices safe-outputs 00000002
  EL2904          0B583052

shape power-distribution
  sm 2 out
  4* pdo 1600+1 7000+10:01/1=chan-##-enable-us 7000+10:02/1=chan-##-enable-up /2
      7000+10:05/1=chan-##-reset-us 7000+10:06/1=chan-##-reset-up /10
  pdo 1604 f707:01/1 /2 f707:04/1=global-reset /12
  sm 3 in
  4* pdo 1a00+1 6000+10:01/1=chan-##-error-us 6000+10:02/1=chan-##-error-up
      6000+10:03/1=chan-##-warning-us 6000+10:04/1=chan-##-warning-up
      6000+10:05/1=chan-##-poweron-us 6000+10:06/1=chan-##-poweron-up 6000+10:07/1 /6 6000+10:0e/1
      6000+10:0f/1 6000+10:10/1
  pdo 1a04 f607:01/1=warning-temp f607:02/1=error-temp f607:03/1=warning-us f607:04/1=error-us
      f607:05/1=warning-up f607:06/1=error-up f607:07/1 /4 f607:0c/1 /2 f607:0f/1 f607:10/1
  4* object-pin chan-##-current-limit-type object=8000+10:11 bits=16 signed=1
  4* object-pin chan-##-current-limit-us object=8000+10:12 bits=16 per-unit=1000
  4* object-pin chan-##-current-limit-up object=8000+10:13 bits=16 per-unit=1000
devices power-distribution 00000002
  EP9214          23FE4052

shape brake-chopper
  sm 3 in
  pdo 1a00 6000:01/1=power-ok 6000:02/1=overload 6000:03/1 6000:04/1 6000:05/1 6000:06/1 /8
      6000:0f/2 6000:11/32 6000:13/32s 6000:14/8
devices brake-chopper 00000002
  EL9576          25683052

shape led-outputs
  sm 2 out assign
  N* pdo 1600+1 7000+10:11/16
  sm 3 in assign
  N* pdo 1a00+2 /5 6000+10:06/1=warning-# 6000+10:07/1=error-# /8 6000+10:10/1
  N* pwm-output # val=7000+10:11
  N* object-value gamma-# object=8000+10:24 real=1
  N* object-value ramp-time-# object=8000+10:25 real=1
  object-value frequency object=f819:11
  object-param master-gain object=f819:12 bits=16 signed=1 initial=32767 min=0 max=32767
devices led-outputs 00000002
  EL2564          0A043052 4

shape display
  sm 2 out write
  pdo 1600 7000:11/16=value-1 7000:12/16=value-2
  4* pdo 1601+1 7010+10:01/1=ch#.timer-start 7010+10:02/1=ch#.timer-reset /5
      7010+10:08/1=ch#.counter-clock 7010+10:09/1=ch#.counter-reset /7
  sm 3 in write
  pdo 1a00 /2 6000:03/1=keyboard.button-up 6000:04/1=keyboard.button-down
      6000:05/1=keyboard.button-left 6000:06/1=keyboard.button-right 6000:07/1=keyboard.button-enter
      /8 6000:10/1=keyboard.button-toggle
  4* pdo 1a01+1 /14 6010+10:0f/2 6010+10:11/32=ch#.timer 6010+10:12/32=ch#.counter
  pdo 1a05 /14 f600:0f/2 f600:11/32=operating-time
  number operating-time-hour val=f600:11 unsigned=1 divisor=3600
devices display 00000002
  EL6090          17CA3052

shape soe-drive-inputs
  pdo 0010+1000 0087:01+1/16 0033:01+1/32s 0054:01+1/16s
  [enableFB2=1] entries 0035:01+1/32s
  [enableDiag=1] entries 0186:01+1/32
values soe-drive drive=# status=0087:01+1 control=0086:01+1 target=0018:01+1 position=0033:01+1
      torque=0054:01+1
shape soe-drive-axis
  [enableFB2=0] soe-drive % $soe-drive
  [enableFB2=1] soe-drive % $soe-drive position2=0035:01+1
  [enableDiag=1] number %srv-diag val=0186:01+1 unsigned=1
shape soe-drive-process-data
  option enableFB2 0 1
  option enableDiag 0 1
  sm 2 out
  N* pdo 0018+1000 0086:01+1/16 0018:01+1/32s
  sm 3 in
  N* like soe-drive-inputs
shape soe-drive
  like soe-drive-process-data
  like soe-drive-axis
devices soe-drive 00000002
  AX5101          13ED6012 1
  AX5103          13EF6012 1
  AX5106          13F26012 1
  AX5112          13F86012 1
  AX5118          13FE6012 1

shape soe-drive-2
  like soe-drive-process-data
  N* like soe-drive-axis ch#.
devices soe-drive-2 00000002
  AX5203          14536012 2
  AX5206          14566012 2

values drive-safety-outputs e700:01/8 6640:00/1 6650:01/1 6670:01/1 6668:01/1 6680:01/1 66d0:00/1
      66d1:00/1 6632:00/1 /8 e700:03/16
values drive-safety-inputs e600:01/8 6640:00/1 66e0:01/1 66e0:02/1 6668:01/1 6680:01/1 66d0:00/1
      66d1:00/1 6632:00/1 /8 e600:03/16
shape drive-safety-card
  follows soe-drive soe-drive-2
  fsoe 2 2 N e600 e700
  sm 2 out
  pdo 1600 $drive-safety-outputs
  [N=2] entries 6e40:00/1 6e50:01/1 6e70:01/1 6e68:01/1 6e80:01/1 6ed0:00/1 6ed1:00/1 6e32:00/1 /8
      e700:04/16
  entries e700:02/16
  N* pdo 1601+1 2050+800:00/32s 2051+800:00/32s
  sm 3 in
  pdo 1a00 $drive-safety-inputs
  [N=2] entries 6e40:00/1 6ee0:01/1 6ee0:02/1 6e68:01/1 6e80:01/1 6ed0:00/1 6ed1:00/1 6e32:00/1 /8
      e600:04/16
  entries e600:02/16
  N* pdo 1a01+1 6611+800:00/32s 6613+800:00/32s
  number fsoe-master-cmd val=e700:01 unsigned=1
  number fsoe-master-connid val=e700:02 unsigned=1
  number fsoe-slave-cmd val=e600:01 unsigned=1
  number fsoe-slave-connid val=e600:02 unsigned=1
  [N=1] number fsoe-master-crc val=e700:03 unsigned=1
  [N=1] number fsoe-slave-crc val=e600:03 unsigned=1
  [N=1] flag fsoe-in-sto val=6640:00
  [N=2] 2* number fsoe-master-crc-# val=e700:03+1 unsigned=1
  [N=2] 2* number fsoe-slave-crc-# val=e600:03+1 unsigned=1
  [N=2] 2* flag fsoe-in-sto-# val=6640+800:00
devices drive-safety-card 00000002
  AX5805          16AD6012 1

shape mixed-io-box
  sm 0 out
  pdo 1600 2*7000:01+1/16s
  pdo 1601 8*7001:01+1/1
  pdo 1602 8*7002:01+1/1
  sm 1 in
  pdo 1a00 4*6000:01+1/16s
  pdo 1a01 8*6001:01+1/1
  pdo 1a02 8*6002:01+1/1
  pdo 1a03 6003:01/1 6003:02/1 /6
  8* din din-# in=6001:01+1
  8* din din-#+8 in=6002:01+1
  8* dout dout-# out=7001:01+1
  8* dout dout-#+8 out=7002:01+1
  4* ain ain-# val=6000:01+1
  2* aout aout-# val=7000:01+1
devices mixed-io-box 0000079A
  EasyIO          0DEBACCA

values pulse-axis count=6001:01+1 flag=6006:01+1 frequency=7001:01+1 direction=7003:01+1
      hold=7004:01+1 select=7004:06
shape pulse-axes
  sm 0 out unwatched
  pdo 1600 7000:01/16s
  pdo 1601 5*7001:01+1/32
  pdo 1602 5*7002:01+1/1=axis#-enable5V /3
  pdo 1603 5*7003:01+1/1 /3
  pdo 1604 7*7004:01+1/1 /1
  pdo 1605 5*7005:01+1/1 /3
  pdo 1606 5*7006:01+1/1=axis#-enable24V 7006:06/1=dout-inverter-enable 2*7006:07+1/1=dout-#
  sm 1 in
  pdo 1a00 2*6000:01+1/16
  pdo 1a01 5*6001:01+1/16
  pdo 1a02 5*6002:01+1/16
  pdo 1a06 5*6006:01+1/1 /3
  pdo 1a04 5*6004:01+1/1=axis#-home /3
  pdo 1a03 5*6003:01+1/1=axis#-drvok 6003:06/1=din-inverter-drvok /2
  pdo 1a05 5*6005:01+1/1 /3
  pdo 1a07 4*6007:01+1/1=din-# 6007:05/1=probe /3
  5* pulse-axis axis# $pulse-axis
  inverter-voltage inverter val=7000:01
  2* scaled adc#-value val=6000:01+1 unsigned=1
devices pulse-axes 0000079A
  EpoCAT          04DECADE

values speed-drive state=28c8:00 speed=2864:00 torque=2802:00 speed-state=26c8:00 position=2809:00
      control=20b4:00 set-point=26e6:00 torque-limit=24e6:00
shape speed-drive
  option isMultiturn 0 1
  option extEnc none 0 1 2 3 4 5 6 7 8
  sm 2 out write
  pdo 1600 20b4:00/8 26e6:00/16s 24e6:00/16s
  sm 3 in write
  pdo 1a00 28c8:00/8 2864:00/16s 2802:00/16s 26c8:00/16
  pdo 1a01 2809:00/32
  [extEnc=0,1,2] entries 289a:00/32
  [extEnc=3,4,5] entries 289b:00/32
  [extEnc=6,7,8] entries 289c:00/32
  [isMultiturn=1] set - bits=32
  [extEnc=0,3,6] set - external-turn=1048576
  [extEnc=1] set - external-bits=16 external-turn=65536
  [extEnc=2] set - external-bits=16
  [extEnc=4,7] set - external-turn=4294967296
  [extEnc=5,8] set - external-bits=16 external-shift=16
  [extEnc=none] speed-drive - $speed-drive
  [extEnc=0,1,2] speed-drive - $speed-drive external=289a:00
  [extEnc=3,4,5] speed-drive - $speed-drive external=289b:00
  [extEnc=6,7,8] speed-drive - $speed-drive external=289c:00
devices speed-drive 000000B9
  StMDS5k         00001388

unsupported EL1918_LOGIC Ph3LM2RM
)";
// clang-format on

}  // namespace hal::ethercat::config
