; An application that notes how often it was started, and every I/O register at its first
; instruction. It is busy for 100 ms and then sends a byte.
#define LOG 0x3F00
#define REGISTERS 0x3E00

        jmp 1f
        ; The header of an image; the test fills it in.
        .org 0x8C
        .fill 16, 1, 0xFF
1:      ldi r30, lo8(0x20)
        ldi r31, hi8(0x20)
        ldi r28, lo8(REGISTERS)
        ldi r29, hi8(REGISTERS)
2:      ld r16, Z+
        st Y+, r16
        cpi r31, 1
        brne 2b
        lds r16, LOG
        inc r16
        sts LOG, r16
        ; 8 million cycles, five in each round
        ldi r18, 8
3:      ldi r17, 200
4:      ldi r16, 200
5:      nop
        nop
        dec r16
        brne 5b
        dec r17
        brne 4b
        dec r18
        brne 3b
        ldi r16, 1
        sts 0xC4, r16
        ldi r16, 0x08
        sts 0xC1, r16
        ldi r16, 0x5A
        sts 0xC6, r16
6:      rjmp 6b
