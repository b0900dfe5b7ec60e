/* Programs its own flash from the boot section and notes what it sees. CASE chooses what is done
   after that. The section `.low` lies in the application's part. */
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <util/delay.h>

#ifndef HIGH_FUSE
#define HIGH_FUSE 0x9A /* 4 KiB of boot section, and the chip starts there */
#endif
FUSES = {.low = 0xF7, .high = HIGH_FUSE, .extended = 0xFC};

#define LOG ((volatile uint8_t *)0x3F00)
#define FAR 0x10100UL    /* beyond the first 64 KiB */
#define HALTS 0x1E000UL  /* in the part that halts the core */
#define OWN 0x1F800UL    /* in the boot section, behind this program */

/* `rjmp .-2`, where the application would start. */
__attribute__((section(".low"), used)) static const uint8_t application[] = {0xFF, 0xCF, 0x5A};

/* SPM, one cycle after its command or later. */
#define SPM(address, word, command, wait)                                                          \
    do {                                                                                           \
        RAMPZ = (address) >> 16;                                                                   \
        __asm__ volatile("movw r0, %A1\n\tout %2, %3\n\t" wait "spm\n\tclr __zero_reg__"           \
                         :                                                                         \
                         : "z"((uint16_t)(address)), "r"((uint16_t)(word)),                        \
                           "I"(_SFR_IO_ADDR(SPMCSR)), "r"((uint8_t)(command))                      \
                         : "r0");                                                                  \
    } while (0)
#define ERASE (_BV(SPMEN) | _BV(PGERS))
#define WRITE (_BV(SPMEN) | _BV(PGWRT))
#define READ_AGAIN (_BV(SPMEN) | _BV(RWWSRE))
static uint8_t at(uint32_t address) { return pgm_read_byte_far(address); }
static void wait(void) { while (SPMCSR & _BV(SPMEN)) {} }
static uint8_t fuse(uint8_t place) {
    uint8_t byte;
    RAMPZ = 1;
    __asm__ volatile("out %1, %2\n\tlpm %0, Z"
                     : "=r"(byte)
                     : "I"(_SFR_IO_ADDR(SPMCSR)), "r"((uint8_t)(_BV(SPMEN) | _BV(BLBSET))),
                       "z"((uint16_t)place));
    return byte;
}

int main(void) {
    uint16_t start;
    TCCR1B = _BV(CS11) | _BV(CS10); /* clk/64: 4 us */
    LOG[0] = at(2);

    /* Erase: busy for 4.5 ms, and nothing below 0x1E000 can be read. */
    start = TCNT1;
    SPM(FAR, 0, ERASE, "");
    LOG[1] = SPMCSR;
    LOG[2] = at(2);
    LOG[3] = at(0x1F000UL);
    SPM(FAR, 0, READ_AGAIN, ""); /* not while it is busy */
    wait();
    LOG[4] = TCNT1 - start;
    LOG[5] = (TCNT1 - start) >> 8;
    LOG[6] = SPMCSR;
    LOG[7] = at(2);
    SPM(FAR, 0, READ_AGAIN, "");
    LOG[8] = SPMCSR;
    LOG[9] = at(2);

    /* The first word for a place counts; the next fill makes the section readable. */
    SPM(FAR, 0xF0F0, _BV(SPMEN), "");
    SPM(FAR, 0x1234, _BV(SPMEN), "");
    SPM(FAR, 0, WRITE, "");
    wait();
    LOG[10] = SPMCSR;
    SPM(FAR + 2, 0x0101, _BV(SPMEN), "");
    LOG[11] = SPMCSR;
    LOG[12] = at(FAR);
    LOG[13] = at(FAR + 2);

    /* A write without an erase only clears bits. */
    SPM(FAR, 0x3C3C, _BV(SPMEN), "");
    SPM(FAR, 0, WRITE, "");
    wait();
    SPM(FAR, 0, READ_AGAIN, "");
    LOG[14] = at(FAR);
    LOG[15] = at(FAR + 2);

    /* The upper part: the core stands still meanwhile, and the lower part can be read. */
    start = TCNT1;
    SPM(HALTS, 0, ERASE, "");
    LOG[16] = SPMCSR;
    LOG[17] = TCNT1 - start;
    LOG[18] = (TCNT1 - start) >> 8;
    SPM(HALTS, 0x7777, _BV(SPMEN), "");
    SPM(HALTS, 0, WRITE, "");
    LOG[19] = at(HALTS);
    LOG[20] = at(2);

    for (uint8_t place = 0; place < 4; place++) LOG[21 + place] = fuse(place);

    /* An SPM that comes too late does nothing; neither does one without a command. */
    SPM(FAR, 0, ERASE, "nop\n\tnop\n\tnop\n\tnop\n\tnop\n\t");
    SPM(FAR, 0, 0, "");
    LOG[25] = SPMCSR;
    LOG[26] = at(FAR);

    /* Words in the buffer are lost by a write to the EEPROM, which also holds up SPM. */
    SPM(FAR, 0, _BV(SPMEN), "");
    EEDR = 1;
    EECR = _BV(EEMPE);
    EECR = _BV(EEMPE) | _BV(EEPE);
    SPM(FAR, 0, ERASE, "");
    LOG[27] = SPMCSR;
    while (EECR & _BV(EEPE)) {}
    SPM(FAR, 0, WRITE, "");
    wait();
    SPM(FAR, 0, READ_AGAIN, "");
    LOG[28] = at(FAR);

    /* Its own section, until a lock bit forbids it. */
    SPM(OWN, 0x1111, _BV(SPMEN), "");
    SPM(OWN, 0, WRITE, "");
    SPM(OWN, 0xEF, _BV(SPMEN) | _BV(BLBSET), "");
    SPM(OWN, 0, ERASE, "");
    LOG[29] = at(OWN);
    LOG[30] = fuse(1);
    LOG[31] = 1;

#if CASE == 1
    /* The application is called while the flash is busy. */
    SPM(FAR, 0, ERASE, "");
    __asm__ volatile("jmp 0");
#elif CASE == 2
    /* Erases and writes for ever. */
    for (;;) {
        SPM(FAR, 0, ERASE, "");
        wait();
        for (uint16_t place = 0; place < 256; place += 2) SPM(FAR + place, 0x00FF, _BV(SPMEN), "");
        SPM(FAR, 0, WRITE, "");
        wait();
    }
#endif
    for (;;) {}
}
