//! Packets that other people published, with the sources. The expected values are theirs.

/// One published packet.
pub(crate) struct Vector {
    /// Bytes as published.
    pub(crate) bytes: &'static [u8],
    /// Whether a servo sent it.
    pub(crate) status: bool,
    /// The servo's published answer; empty if there is none.
    pub(crate) reply: &'static [u8],
    /// The packet's effect.
    pub(crate) meaning: &'static str,
    /// Where it was published.
    pub(crate) source: &'static str,
}

/// All published packets.
pub(crate) const VECTORS: &[Vector] = &[
    Vector {
        bytes: &[0xFF, 0xFF, 0x01, 0x05, 0x03, 0x0C, 0x64, 0xAA, 0xDC],
        status: false,
        reply: &[],
        meaning: "WRITE id1 addr 0x0C data 64 AA (the checksum worked example)",
        source: "ROBOTIS e-Manual, \"Protocol 1.0\" (github ROBOTIS-GIT/emanual docs/en/dxl/protocol1.md @097301c; emanual.robotis.com/docs/en/dxl/protocol1)",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0x01, 0x02, 0x01, 0xFB],
        status: false,
        reply: &[0xFF, 0xFF, 0x01, 0x02, 0x00, 0xFC],
        meaning: "PING id1",
        source: "ROBOTIS e-Manual, \"Protocol 1.0\" (github ROBOTIS-GIT/emanual docs/en/dxl/protocol1.md @097301c; emanual.robotis.com/docs/en/dxl/protocol1)",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0xFE, 0x04, 0x03, 0x03, 0x01, 0xF6],
        status: false,
        reply: &[],
        meaning: "WRITE broadcast: ID=1 (no reply)",
        source: "ROBOTIS e-Manual, \"Protocol 1.0\" (github ROBOTIS-GIT/emanual docs/en/dxl/protocol1.md @097301c; emanual.robotis.com/docs/en/dxl/protocol1)",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0xFE, 0x02, 0x05, 0xFA],
        status: false,
        reply: &[],
        meaning: "ACTION broadcast (no reply)",
        source: "ROBOTIS e-Manual, \"Protocol 1.0\" (github ROBOTIS-GIT/emanual docs/en/dxl/protocol1.md @097301c; emanual.robotis.com/docs/en/dxl/protocol1)",
    },
    Vector {
        bytes: &[
            0xFF, 0xFF, 0xFE, 0x0E, 0x83, 0x1E, 0x04, 0x00, 0x10, 0x00, 0x50, 0x01, 0x01, 0x20,
            0x02, 0x60, 0x03, 0x67,
        ],
        status: false,
        reply: &[],
        meaning: "SYNC_WRITE goal position+speed: id0 0x010/0x150, id1 0x220/0x360",
        source: "ROBOTIS e-Manual, \"Protocol 1.0\" (github ROBOTIS-GIT/emanual docs/en/dxl/protocol1.md @097301c; emanual.robotis.com/docs/en/dxl/protocol1)",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0x01, 0x04, 0x00, 0x00, 0x80, 0x7A],
        status: true,
        reply: &[],
        meaning: "bulk-read status id1",
        source: "ROBOTIS e-Manual, \"Protocol 1.0\" (github ROBOTIS-GIT/emanual docs/en/dxl/protocol1.md @097301c; emanual.robotis.com/docs/en/dxl/protocol1)",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0x00, 0x04, 0x03, 0x04, 0x01, 0xF3],
        status: false,
        reply: &[],
        meaning: "manual Ex. 8: WRITE id0 baud rate register = 1 (1 Mbit/s)",
        source: "Public C unit test \"dynamixel.h\" cmocka suite, quoting Examples 1,2,4-8,10,19 of the Dynamixel/AX-12 user manual",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0x01, 0x04, 0x02, 0x00, 0x03, 0xF5],
        status: false,
        reply: &[],
        meaning: "manual Ex. 6: READ id1 model number + firmware (addr 0, 3 bytes)",
        source: "Public C unit test \"dynamixel.h\" cmocka suite, quoting Examples 1,2,4-8,10,19 of the Dynamixel/AX-12 user manual",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0x01, 0x05, 0x04, 0x1E, 0xFF, 0x03, 0xD5],
        status: false,
        reply: &[],
        meaning: "manual Ex. 19: REG_WRITE id1 goal position 1023",
        source: "Public C unit test \"dynamixel.h\" cmocka suite, quoting Examples 1,2,4-8,10,19 of the Dynamixel/AX-12 user manual",
    },
    Vector {
        bytes: &[
            0xFF, 0xFF, 0xFE, 0x18, 0x83, 0x1E, 0x04, 0x00, 0x10, 0x00, 0x50, 0x01, 0x01, 0x20,
            0x02, 0x60, 0x03, 0x02, 0x30, 0x00, 0x70, 0x01, 0x03, 0x20, 0x02, 0x80, 0x03, 0x12,
        ],
        status: false,
        reply: &[],
        meaning: "manual Ex. 5: SYNC_WRITE 4 servos",
        source: "Public C unit test \"dynamixel.h\" cmocka suite, quoting Examples 1,2,4-8,10,19 of the Dynamixel/AX-12 user manual",
    },
    Vector {
        bytes: &[
            0xFF, 0xFF, 0xFE, 0x0A, 0x83, 0x1E, 0x02, 0x0B, 0x00, 0x00, 0x0C, 0x0A, 0x14, 0x1F,
        ],
        status: false,
        reply: &[],
        meaning: "SYNC_WRITE goal position ids 11,12",
        source: "rustypot 1.4.0 src/dynamixel_protocol/v1.rs unit tests (Apache-2.0, github pollen-robotics/rustypot @c79239a)",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0x02, 0x02, 0x08, 0xF3],
        status: false,
        reply: &[],
        meaning: "REBOOT id2 (not AX-12)",
        source: "rustypot 1.4.0 src/dynamixel_protocol/v1.rs unit tests (Apache-2.0, github pollen-robotics/rustypot @c79239a)",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0x01, 0x05, 0x03, 0x1E, 0xCD, 0x00, 0x0B],
        status: false,
        reply: &[],
        meaning: "WRITE id1 goal position 0x0CD = 205",
        source: "ROBOTIS-GIT/DynamixelSDK issue #286, packets a user reports moving a real AX-12A at 1 Mbit/s",
    },
    Vector {
        bytes: &[0xFF, 0xFF, 0x00, 0x05, 0x03, 0x30, 0x40, 0x00, 0x87],
        status: false,
        reply: &[0xFF, 0xFF, 0x00, 0x02, 0x00, 0xFD],
        meaning: "manual Ex. 20: WRITE id0 PUNCH(0x30)=0x0040",
        source: "ROBOTIS DX-116 user manual (auto.manualsonline.com/manuals/mfg/robotis_co_ltd/dx116.html p.10,20,22,28) - recorded [Dynamixel] exchanges, same protocol 1.0",
    },
];
