-- SPDX-License-Identifier: MIT
-- Wireshark dissector of CAN messages in Ethernet frames of type 0x9023, as links `cane:` send them: single (the source system's form),
-- packed, and signed. The layouts are in drivers/can/cane/README.md. TDMA (0x9021) and RTcfg (0x9022) have dissectors in Wireshark itself, which do
-- not know the pings of stations and their answers (docs/tdma.md): those are dissected here.
--
--     tshark -X lua_script:halcyon.lua -r seen.pcapng -Y 'cane.id == 0x080'
--     tshark -X lua_script:halcyon.lua -r seen.pcapng -Y 'tdma_ping'
local cane = Proto("cane", "CAN in Ethernet")

cane.prefs.order = Pref.enum("Byte order of single messages", 1, "COB-ID of a frame with one message (option order= of the link)",
    {{1, "big endian", 1}, {2, "little endian", 2}}, false)

local formats = {[0] = "single", [1] = "packed", [2] = "packed and signed"}
local f = cane.fields
f.format = ProtoField.uint8("cane.format", "Format", base.DEC, formats)
f.version = ProtoField.uint8("cane.version", "Version")
f.messages = ProtoField.uint8("cane.messages", "Messages")
f.session = ProtoField.uint16("cane.session", "Session", base.HEX, nil, 0x7fff)
f.services = ProtoField.bool("cane.services", "Services alone", 16, {"SDO, heartbeats, LSS", "with process data"}, 0x8000)
f.sequence = ProtoField.uint16("cane.sequence", "Sequence")
f.crc = ProtoField.uint16("cane.crc", "Check sequence", base.HEX)
f.crc_status = ProtoField.string("cane.crc.status", "Check sequence status")
f.counter = ProtoField.uint64("cane.counter", "Replay counter")
f.tag = ProtoField.bytes("cane.tag", "Tag")
f.id = ProtoField.uint32("cane.id", "Identifier", base.HEX)
f.extended = ProtoField.bool("cane.extended", "Extended")
f.remote = ProtoField.bool("cane.remote", "Remote")
f.length = ProtoField.uint8("cane.length", "Length")
f.data = ProtoField.bytes("cane.data", "Data")
f.code = ProtoField.string("cane.function", "Function")
f.node = ProtoField.uint8("cane.node", "Node")

local malformed = ProtoExpert.new("cane.malformed", "Malformed CAN message", expert.group.MALFORMED, expert.severity.ERROR)
local wrong_crc = ProtoExpert.new("cane.crc.wrong", "Wrong check sequence", expert.group.CHECKSUM, expert.severity.ERROR)
cane.experts = {malformed, wrong_crc}

local eth_dst, eth_src = Field.new("eth.dst"), Field.new("eth.src")
local functions = {
    [0x080] = "EMCY", [0x180] = "TPDO1", [0x200] = "RPDO1", [0x280] = "TPDO2", [0x300] = "RPDO2", [0x380] = "TPDO3", [0x400] = "RPDO3",
    [0x480] = "TPDO4", [0x500] = "RPDO4", [0x580] = "SDO answer", [0x600] = "SDO request", [0x700] = "heartbeat",
}

-- What the predefined connection set (CiA 301, 7.3.3) makes of an 11-bit identifier: function and node.
local function meaning(id)
    local alone = {[0x000] = "NMT", [0x080] = "SYNC", [0x100] = "TIME", [0x7e4] = "LSS answer", [0x7e5] = "LSS request"}
    if alone[id] then return alone[id] end
    local node = bit.band(id, 0x7f)
    local name = functions[bit.band(id, 0x780)]
    if name and node ~= 0 then return name, node end
end

-- One message: identifier word with flags, its data. `whole` is what it takes in the frame.
local function show(tree, whole, word, length, data)
    local extended, remote = bit.band(word, 0x80000000) ~= 0, bit.band(word, 0x40000000) ~= 0
    local id = bit.band(word, 0x1fffffff)
    local name, node
    if not extended then name, node = meaning(id) end
    local text = string.format(extended and "%08X" or "%03X", id)
    if name then text = text .. " " .. name .. (node and (" " .. node) or "") end
    local item = tree:add(cane, whole, text .. (remote and " (request)" or "") .. ", " .. length .. (length == 1 and " byte" or " bytes"))
    item:add(f.id, whole, id)
    item:add(f.extended, whole, extended)
    item:add(f.remote, whole, remote)
    item:add(f.length, whole, length)
    if name then item:add(f.code, whole, name) end
    if node then item:add(f.node, whole, node) end
    if data then item:add(f.data, data) end
    return text
end

-- CRC-16, polynomial 0x1021, from `crc` on.
local function crc16(bytes, crc)
    for n = 0, bytes:len() - 1 do
        crc = bit.bxor(crc, bit.lshift(bytes:get_index(n), 8))
        for _ = 1, 8 do
            crc = bit.lshift(crc, 1)
            if crc >= 0x10000 then crc = bit.bxor(bit.band(crc, 0xffff), 0x1021) end
        end
    end
    return crc
end

local function single(tvb, tree)
    if tvb:len() < 5 then return tree:add_proto_expert_info(malformed) end
    tree:add(f.format, tvb(0, 0), 0)
    local word = cane.prefs.order == 2 and tvb(0, 4):le_uint() or tvb(0, 4):uint()
    local length = tvb(4, 1):uint()
    local remote = bit.band(word, 0x40000000) ~= 0
    local bytes = remote and 0 or length
    if length > 8 or bit.band(word, 0x20000000) ~= 0 or tvb:len() < 5 + bytes then return tree:add_proto_expert_info(malformed) end
    return show(tree, tvb(0, 5 + bytes), word, length, bytes > 0 and tvb(5, bytes) or nil)
end

-- A packed message at `at`: what it is, and where the next one begins; nothing when it is malformed.
local function packed_message(tvb, at, tree)
    if tvb:len() < at + 2 then return end
    local first = tvb(at, 2):le_uint()
    local length = bit.rshift(first, 12)
    local word, begin, bytes = bit.band(first, 0x7ff), at + 2, length
    if bit.band(first, 0x800) ~= 0 then word = bit.bor(word, 0x40000000) end
    if length == 15 then
        if tvb:len() < at + 7 then return end
        word, length, begin = tvb(at + 2, 4):le_uint(), tvb(at + 6, 1):uint(), at + 7
    end
    bytes = bit.band(word, 0x40000000) ~= 0 and 0 or length
    if length > 8 or tvb:len() < begin + bytes then return end
    return show(tree, tvb(at, begin + bytes - at), word, length, bytes > 0 and tvb(begin, bytes) or nil), begin + bytes
end

local function packed(tvb, tree)
    local version = tvb(1, 1):uint()
    if version < 1 or version > 2 or tvb:len() < (version == 2 and 18 or 10) then return tree:add_proto_expert_info(malformed) end
    local messages = tvb(2, 1):uint()
    tree:add(f.format, tvb(0, 1), version)
    tree:add(f.version, tvb(1, 1))
    tree:add(f.messages, tvb(2, 1))
    tree:add_le(f.session, tvb(4, 2))
    tree:add_le(f.services, tvb(4, 2))
    tree:add_le(f.sequence, tvb(6, 2))
    local crc = tree:add_le(f.crc, tvb(8, 2))
    local at = 10
    if version == 2 then
        tree:add_le(f.counter, tvb(10, 8))
        at = 18
    end
    local begin, texts = at, {}
    for _ = 1, messages do
        local text, next_at = packed_message(tvb, at, tree)
        if not text then
            tree:add_proto_expert_info(malformed)
            return table.concat(texts, ", ")
        end
        texts[#texts + 1], at = text, next_at
    end
    local dst, src = eth_dst(), eth_src()
    if dst and src then
        local head = dst.range:bytes()
        head:append(src.range:bytes())
        head:append(ByteArray.new("9023"))
        head:append(tvb(0, 8):bytes())
        if version == 2 then head:append(tvb(10, 8):bytes()) end
        if at > begin then head:append(tvb(begin, at - begin):bytes()) end
        local good = crc16(head, 0xffff) == tvb(8, 2):le_uint()
        tree:add(f.crc_status, tvb(8, 2), good and "good" or "bad"):set_generated()
        if not good then crc:add_proto_expert_info(wrong_crc) end
    end
    if version == 2 and tvb:len() >= at + 8 then tree:add(f.tag, tvb(at, 8)) end
    return table.concat(texts, ", ")
end

function cane.dissector(tvb, pinfo, root)
    pinfo.cols.protocol = "CANE"
    local tree = root:add(cane, tvb())
    local is_packed = tvb:len() >= 10 and tvb(0, 1):uint() == 0xec and tvb(3, 1):uint() == 0xec
    local text = is_packed and packed(tvb, tree) or (not is_packed and single(tvb, tree))
    pinfo.cols.info = type(text) == "string" and text or "malformed"
    return tvb:len()
end

DissectorTable.get("ethertype"):add(0x9023, cane)

local ping = Proto("tdma_ping", "TDMA ping between stations")
local p = ping.fields
p.id = ProtoField.uint16("tdma_ping.id", "Frame", base.HEX, {[0x20] = "ping", [0x21] = "answer"})
p.number = ProtoField.uint32("tdma_ping.number", "Number")
p.asked = ProtoField.uint64("tdma_ping.asked", "Asked at (ns, clock of the asking station)")
p.received = ProtoField.uint64("tdma_ping.received", "Received at (ns, clock of the answering station)")
p.answered = ProtoField.uint64("tdma_ping.answered", "Answered at (ns, clock of the answering station)")
p.held = ProtoField.uint64("tdma_ping.held", "Held for (ns)")
local cut = ProtoExpert.new("tdma_ping.malformed", "Malformed TDMA ping", expert.group.MALFORMED, expert.severity.ERROR)
ping.experts = {cut}

local rtmac = DissectorTable.get("ethertype"):get_dissector(0x9021)

-- Behind the Ethernet header: discipline (1: TDMA), version, flags (1: tunnelled), version of TDMA, which frame it is, its fields.
function ping.dissector(tvb, pinfo, root)
    local is_ping = tvb:len() >= 8 and tvb(0, 2):uint() == 1 and bit.band(tvb(3, 1):uint(), 1) == 0 and tvb(4, 2):uint() == 0x0201
    local id = is_ping and tvb(6, 2):uint()
    if id ~= 0x20 and id ~= 0x21 then
        if rtmac then return rtmac:call(tvb, pinfo, root) end
        return 0
    end
    pinfo.cols.protocol = "TDMA"
    local tree = root:add(ping, tvb())
    tree:add(p.id, tvb(6, 2))
    if tvb:len() < (id == 0x20 and 20 or 36) then
        pinfo.cols.info = "malformed"
        tree:add_proto_expert_info(cut)
        return tvb:len()
    end
    local number = tvb(id == 0x20 and 16 or 32, 4)
    tree:add(p.number, number)
    tree:add(p.asked, tvb(8, 8))
    if id == 0x21 then
        tree:add(p.received, tvb(16, 8))
        tree:add(p.answered, tvb(24, 8))
        tree:add(p.held, tvb(16, 16), tvb(24, 8):uint64() - tvb(16, 8):uint64()):set_generated()
    end
    pinfo.cols.info = (id == 0x20 and "Ping " or "Answer to ping ") .. number:uint()
    return tvb:len()
end

DissectorTable.get("ethertype"):add(0x9021, ping)
