; When the handler of timer 1's compare match starts, by the timer, awake and from sleep; and how
; many instructions run between SEI and a handler that waits.
#include <avr/io.h>
#define LOG 0x3F00

        .global main
main:   ldi r16, (1 << CS10)
        sts TCCR1B, r16
        ldi r16, (1 << OCIE1A)
        sts TIMSK1, r16
        ; awake, among instructions of one cycle
        ldi r28, lo8(LOG)
        ldi r29, hi8(LOG)
        call arm
        .rept 1200
        nop
        .endr
        ; asleep
        call arm
        ldi r16, (1 << SE)
        out _SFR_IO_ADDR(SMCR), r16
        sleep
        ; waiting
        cli
        call arm
        cli
        .rept 1200
        nop
        .endr
        ldi r24, 0
        sei
        inc r24
        inc r24
        inc r24
1:      rjmp 1b

arm:    ldi r16, 0
        sts TCNT1H, r16
        sts TCNT1L, r16
        ldi r16, hi8(1000)
        sts OCR1AH, r16
        ldi r16, lo8(1000)
        sts OCR1AL, r16
        ldi r16, (1 << OCF1A)
        out _SFR_IO_ADDR(TIFR1), r16
        sei
        ret

        .global TIMER1_COMPA_vect
TIMER1_COMPA_vect:
        lds r18, TCNT1L
        lds r19, TCNT1H
        st Y+, r18
        st Y+, r19
        st Y+, r24
        reti
