//! The first instructions. There is no C library: the loader has no interrupts and no static data.

use core::arch::global_asm;
use core::panic::PanicInfo;

use lager_loader::fuses;

// The linker puts `.vectors` first, so the chip starts here. The stack begins below the mark by
// which an application asks for the loader.
global_asm!(
    ".section .vectors,\"ax\",@progbits",
    "rjmp 1f",
    ".section .init2,\"ax\",@progbits",
    "1:",
    "cli",
    "clr r1",
    "out 0x3f, r1",
    "ldi r28, lo8({stack})",
    "ldi r29, hi8({stack})",
    "out 0x3e, r29",
    "out 0x3d, r28",
    ".section .init9,\"ax\",@progbits",
    "rjmp main",
    ".text",
    stack = const lager_loader::entry::MARK_AT - 1,
);

/// The fuses that README explains: low, high, extended. A programmer and the emulator read them.
#[used]
#[unsafe(link_section = ".fuse")]
static FUSES: [u8; 3] = [fuses::LOW, fuses::HIGH, fuses::EXTENDED];
/// The lock bits: SPM cannot write the boot section.
#[used]
#[unsafe(link_section = ".lock")]
static LOCK: [u8; 1] = [fuses::LOCK];

/// Nothing in the loader panics; the compiler asks for this.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {
        avr_device::asm::nop();
    }
}
